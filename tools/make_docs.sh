#!/bin/sh
# Build the documentation as a site in build/site. Any warning fails.
set -eu
cd "$(dirname "$0")/.."
. tools/setup.sh
. tools/install_editable.sh
if ! [ .venv/ready_docs -nt tools/requirements_docs.txt ] || ! [ .venv/ready_docs -nt .venv/ready ]; then
  echo "asperity: installing the tools of the documentation into .venv" >&2
  python -m pip install -q --disable-pip-version-check -r tools/requirements_docs.txt
  touch .venv/ready_docs
fi

rm -rf build/fortran build/site
mkdir -p build/fortran
PYTHONPATH=tools ford tools/ford.md >build/ford.log 2>&1 || { cat build/ford.log >&2; exit 1; }
if grep -i warning build/ford.log; then
  echo "asperity: FORD warns" >&2
  exit 1
fi
python tools/localize_ford.py build/fortran/fortran
python -m sphinx -q -W --keep-going -j auto -c docs -d build/doctrees . build/site
# Redirect from the folder itself to the first page.
cat >build/site/index.html <<'EOF'
<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Asperity</title>
<meta http-equiv="refresh" content="0; url=docs/index.html"></head>
<body><p><a href="docs/index.html">Documentation of Asperity</a></p></body></html>
EOF
python tools/check_site.py build/site
echo "documentation: build/site/index.html"
