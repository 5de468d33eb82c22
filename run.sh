#!/bin/sh
# Run a case and draw its result: ./run.sh [CASE.nml [options of `asperity run`]]
# Sets up and builds what is missing first. Without a case: the main example, some minutes.
set -eu
caller=$PWD
cd "$(dirname "$0")"
root=$PWD
. tools/setup.sh
. tools/install_editable.sh
cd "$caller"

case ${1:--} in
  -*) input=$root/examples/two_scale_road/input.nml ;;
  *) input=$1; shift ;;
esac
program=$root/.venv/python/asperity

# Where the result goes: --output, or what the case says.
result=
for word in "" "$@"; do
  case $word in --output=*) result=${word#--output=} ;; esac
  [ "${previous-}" != --output ] || result=$word
  previous=$word
done
settings=$("$program" check "$input") || exit $?
[ -n "$result" ] ||
  result=$(printf '%s\n' "$settings" | sed -n "/^&output/,\$s/^  file = '\(.*\)'\$/\1/p")

status=0
"$program" run "$input" "$@" || status=$?
case $status in
  0 | 4) python -m asperity plot "$result" || exit $? ;;
esac
exit $status
