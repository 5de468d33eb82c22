# Completion of the command asperity for bash: commands, options, and the files that each one takes.
_asperity() {
  local current=${COMP_WORDS[COMP_CWORD]} verb=${COMP_WORDS[1]} files
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "run check template info plot report watch import fit friction
      --help --version" -- "$current"))
    return
  fi
  if [[ $current == -* ]]; then
    # Each command lists its own options, so that the list is that of the installed version.
    COMPREPLY=($(compgen -W "$("${COMP_WORDS[0]}" "$verb" --help 2>/dev/null |
      grep -oE -- '--[a-z][a-z-]*' | sort -u) --help" -- "$current"))
    return
  fi
  case $verb in
    run | check) files='@(nml|NML)' ;;
    info | plot | report | watch) files='@(h5|hdf5)' ;;
    template)
      COMPREPLY=($(compgen -W "$("${COMP_WORDS[0]}" template 2>/dev/null |
        awk '{ print $1 }')" -- "$current"))
      return
      ;;
    *) files= ;;
  esac
  case ${COMP_WORDS[COMP_CWORD - 1]} in
    --threads) return ;;
    -o | --output | --plot) files= ;;
  esac
  local IFS=$'\n' name extglob_was_off=
  shopt -q extglob || extglob_was_off=yes
  shopt -s extglob
  for name in $(compgen -f -- "$current"); do
    # shellcheck disable=SC2053
    if [ -d "$name" ]; then
      COMPREPLY+=("$name/")
    elif [ -z "$files" ] || [[ $name == *.$files ]]; then
      COMPREPLY+=("$name")
    fi
  done
  [ -z "$extglob_was_off" ] || shopt -u extglob
  [[ ${COMPREPLY[0]} != */ ]] || compopt -o nospace 2>/dev/null
}
complete -F _asperity asperity
