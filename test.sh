#!/bin/sh
# Set up what is missing and pass every check and test: the Fortran ones, then the Python ones.
set -eu
cd "$(dirname "$0")"
. tools/setup.sh

python tools/check_sources.py
fortitude check --quiet
ruff check --quiet

fpm test --profile release

. tools/install_editable.sh
python -m pytest -q
