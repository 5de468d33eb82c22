#!/bin/sh
# Build the source archive and, from it, a wheel that carries its shared libraries: build/dist.
# About two minutes. On Linux only; the wheel runs where the C library is as new as here
# (tools/make_portable_wheel.sh builds one for older systems).
# The libraries are those of the system, or of tools/build_libraries.sh PREFIX where ASPERITY_LIBRARIES=PREFIX.
set -eu
caller=$PWD
cd "$(dirname "$0")/.."
ASPERITY_PORTABLE=1
. tools/setup.sh
. tools/setup_wheel.sh

if [ -n "${ASPERITY_LIBRARIES:-}" ]; then
  ASPERITY_LIBRARIES=$(cd "$caller" && cd "$ASPERITY_LIBRARIES" && pwd)
  PKG_CONFIG_PATH=$ASPERITY_LIBRARIES/lib/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
  LD_LIBRARY_PATH=$ASPERITY_LIBRARIES/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  export ASPERITY_LIBRARIES PKG_CONFIG_PATH LD_LIBRARY_PATH
fi

rm -rf build/dist build/plain
python -m build --no-isolation -o build/plain .
auditwheel repair -w build/plain/repaired build/plain/*.whl
python tools/add_licences.py build/plain/repaired/*.whl
twine check --strict build/plain/repaired/*.whl build/plain/*.tar.gz
mkdir -p build/dist
mv build/plain/repaired/*.whl build/plain/*.tar.gz build/dist
rm -rf build/plain
ls build/dist
