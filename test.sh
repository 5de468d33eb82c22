#!/bin/sh
# Set up what is missing and pass every check and test: the Fortran ones, then the Python ones.
set -eu
cd "$(dirname "$0")"
. tools/setup.sh
. tools/setup_browser.sh

# A fault of style is reported first and fails the whole, but only after the tests.
status=0
python tools/check_sources.py || status=1
fortitude check --quiet || status=1
ruff check --quiet || status=1
mypy --no-error-summary || status=1

fpm test --profile release
# Some Python tests let the Fortran driver write results: this one, not one of another build.
ASPERITY_CHECK=$PWD/$(fpm test --profile release --runner echo 2>/dev/null | grep '/check' | tail -n 1)
export ASPERITY_CHECK

. tools/install_editable.sh
# Two tests at a time, which halves the time; most tests use one thread.
python -m pytest -q -n 2 --dist worksteal || status=1
exit $status
