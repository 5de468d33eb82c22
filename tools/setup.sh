# Sourced by run.sh and test.sh from the project's root: installs what is missing, once, and leaves
# fpm, python and the other tools on PATH. Afterwards it does nothing.
set -eu

packages="gcc gfortran libc6-dev pkg-config libfftw3-dev libhdf5-dev zlib1g-dev python3 python3-dev python3-venv"
if command -v apt-get >/dev/null 2>&1; then
  if ! dpkg -s $packages >/dev/null 2>&1; then
    sudo=
    [ "$(id -u)" = 0 ] || sudo=sudo
    echo "asperity: installing Debian packages: $packages" >&2
    $sudo apt-get update -qq
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends \
      $packages >/dev/null
  fi
else
  missing=
  for tool in gcc gfortran pkg-config python3; do
    command -v $tool >/dev/null 2>&1 || missing="$missing $tool"
  done
  if command -v pkg-config >/dev/null 2>&1; then
    for library in fftw3 fftw3f hdf5 zlib; do
      pkg-config --exists $library || missing="$missing $library"
    done
  fi
  if [ -n "$missing" ]; then
    echo "asperity: not found:$missing" >&2
    echo "asperity: install gcc, gfortran, pkg-config, FFTW 3 (double and single)," >&2
    echo "asperity: HDF5, zlib, and Python 3.10 or newer; docs/install.md" >&2
    echo "asperity: lists the packages of conda-forge and Homebrew." >&2
    exit 1
  fi
fi

if ! [ .venv/ready -nt pyproject.toml ] || ! [ .venv/ready -nt tools/requirements.txt ]; then
  echo "asperity: installing the Python tools into .venv" >&2
  python3 -m venv .venv
  .venv/bin/python -m pip install -q --disable-pip-version-check -r tools/requirements.txt
  touch .venv/ready
fi
PATH=$PWD/.venv/bin:$PATH
export PATH

# What is built here is for this machine: where its processor has vector registers of 256 bits, they are used. Products
# and sums stay separate operations and round as on other machines. ASPERITY_PORTABLE=1 builds for all processors.
for name in FFLAGS FPM_FFLAGS; do
  eval "flags=\${$name:-}"
  flags=$(printf '%s' "$flags" | sed 's/ *-mavx2//g')
  if [ -z "${ASPERITY_PORTABLE:-}" ] && grep -qsw avx2 /proc/cpuinfo; then
    case $flags in
      *-march=*) ;;
      *) flags="${flags:+$flags }-mavx2" ;;
    esac
  fi
  export "$name=$flags"
done

# fpm.toml asks the linker for Debian's name of the serial HDF5 library. Elsewhere the library is
# called hdf5: give it the other name in a folder that the compiler searches.
if ! pkg-config --exists hdf5-serial 2>/dev/null && pkg-config --exists hdf5 2>/dev/null; then
  mkdir -p .venv/lib
  for library in "$(pkg-config --variable=libdir hdf5)"/libhdf5.so \
      "$(pkg-config --variable=libdir hdf5)"/libhdf5.dylib; do
    if [ -e "$library" ]; then
      ln -sf "$library" ".venv/lib/libhdf5_serial.${library##*.}"
    fi
  done
  LIBRARY_PATH=$PWD/.venv/lib${LIBRARY_PATH:+:$LIBRARY_PATH}
  export LIBRARY_PATH
fi
