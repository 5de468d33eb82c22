# Sourced after tools/setup.sh: installs the tools that build wheels, once.
if ! [ .venv/ready_wheel -nt tools/requirements_wheel.txt ] || ! [ .venv/ready_wheel -nt .venv/ready ]; then
  echo "asperity: installing the tools that build wheels into .venv" >&2
  python -m pip install -q --disable-pip-version-check -r tools/requirements_wheel.txt
  touch .venv/ready_wheel
fi
