#!/bin/sh
# Build the program with MPI as .venv/bin/asperity-mpi, after installing what is missing: Open MPI
# from Debian's packages, or any MPI whose compiler `mpifort` is on PATH.
#
#   tools/build_mpi.sh
#   mpirun -n 4 .venv/bin/asperity-mpi run CASE.nml
set -eu
cd "$(dirname "$0")/.."
. tools/setup.sh

if ! command -v mpifort >/dev/null 2>&1; then
  if ! command -v apt-get >/dev/null 2>&1; then
    echo "asperity: mpifort was not found: install MPI with its Fortran module mpi_f08" >&2
    exit 1
  fi
  packages="libopenmpi-dev openmpi-bin"
  sudo=
  [ "$(id -u)" = 0 ] || sudo=sudo
  echo "asperity: installing Debian packages: $packages" >&2
  $sudo apt-get update -qq
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends \
    $packages >/dev/null
fi

# The results of both programs are the same to the last bit only if both use the same vector registers.
if command -v asperity >/dev/null 2>&1 && ! asperity --version | grep -q AVX2; then
  ASPERITY_PORTABLE=1
  . tools/setup.sh
fi

# fpm keeps the build apart from that of the program without MPI, because the compiler differs.
fpm build --profile release --compiler mpifort --flag "-DASPERITY_MPI $FPM_FFLAGS" asperity
program=$(fpm run --profile release --compiler mpifort --flag "-DASPERITY_MPI $FPM_FFLAGS" --runner echo asperity |
  grep '/app/asperity' | tail -n 1)
# A running program keeps the old file.
cp "$program" .venv/bin/asperity-mpi.new
mv .venv/bin/asperity-mpi.new .venv/bin/asperity-mpi
.venv/bin/asperity-mpi --version
