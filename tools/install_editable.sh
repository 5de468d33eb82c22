# Sourced from the project's root after tools/setup.sh: makes `import asperity` in .venv use this
# tree. Later changes of sources are compiled by ninja; importing the package does so, too.
# `.venv/installed` holds the compiler flags of the build.
if [ .venv/installed -nt pyproject.toml ] && [ .venv/installed -nt .venv/ready ] &&
  [ "$(cat .venv/installed)" = "$FFLAGS" ]; then
  if ! ninja -C .venv/python >.venv/ninja.log 2>&1; then
    cat .venv/ninja.log >&2
    exit 1
  fi
else
  echo "asperity: building the Python package" >&2
  python -m pip install -q --disable-pip-version-check --no-build-isolation --no-deps \
    --config-settings=build-dir=.venv/python --config-settings=setup-args="-Dfortran_args=$FFLAGS" -e .
  echo "$FFLAGS" >.venv/installed
fi
# The program on PATH; meson-python leaves it in the build folder.
ln -sf ../python/asperity .venv/bin/asperity
