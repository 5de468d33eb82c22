#!/bin/sh
# Build the program with the transforms of Intel's MKL in the place of FFTW as .venv/bin/asperity-mkl,
# after installing MKL from PyPI (about 300 MB).
#
#   tools/build_mkl.sh
#   .venv/bin/asperity-mkl run CASE.nml
#
# MKL has the interface of FFTW. Its libraries come first when the program is linked, so that every
# transform is found there, and FFTW, which the manifest names, remains unused.
set -eu
cd "$(dirname "$0")/.."
. tools/setup.sh

.venv/bin/python -m pip install -q --disable-pip-version-check mkl-devel
libraries=$PWD/.venv/lib
link=$(PKG_CONFIG_PATH="$libraries/pkgconfig" pkg-config --libs mkl-dynamic-lp64-seq)

# The libraries stand before the objects that need them, where the linker would leave them out. The macro
# also keeps this build apart from that with FFTW.
link="-Wl,-rpath,$libraries -Wl,--push-state,--no-as-needed $link -Wl,--pop-state"
fpm build --profile release --flag "-DASPERITY_MKL $FPM_FFLAGS" --link-flag "$link" asperity
program=$(fpm run --profile release --flag "-DASPERITY_MKL $FPM_FFLAGS" --link-flag "$link" --runner echo asperity |
  grep '/app/asperity' | tail -n 1)
# A running program keeps the old file.
cp "$program" .venv/bin/asperity-mkl.new
mv .venv/bin/asperity-mkl.new .venv/bin/asperity-mkl
.venv/bin/asperity-mkl --version
