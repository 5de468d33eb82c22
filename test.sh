#!/bin/sh
# Set up what is missing and pass every test: the Fortran ones, then the Python ones.
set -eu
cd "$(dirname "$0")"
. tools/setup.sh
fpm test --profile release
