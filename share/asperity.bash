# Completion of the command asperity for bash: commands, options and their values, and files.

_asperity_fields="pressure gap displacement_z contact road_height traction_x traction_y
  displacement_x displacement_y slip_x slip_y"
_asperity_columns="step phase time pressure force displacement contact_area mean_gap road_x road_y
  traction_x traction_y stick_area sliding_speed friction_viscous friction work_normal
  work_tangential work_load work_drive work_missing energy_elastic energy_adhesive energy_kinetic
  energy_radiated dissipated_viscous dissipated_numerical dissipated_friction power_viscous
  power_friction iterations_normal iterations_tangential residual_normal residual_tangential passes
  residual_coupling ffts seconds"

_asperity() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
  local verb=${COMP_WORDS[1]} files= help= values=
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "run check template info plot report watch import fit friction
      --help --version" -- "$current"))
    return
  fi
  # Each command lists its own options, so that the list is that of the installed version.
  if [[ $current == -* || $previous == -* ]]; then
    help=$("${COMP_WORDS[0]}" "$verb" --help 2>/dev/null)
  fi
  if [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W "$(grep -oE -- '--[a-z][a-z-]*' <<<"$help" | sort -u) --help" \
      -- "$current"))
    return
  fi
  case $verb in
    run | check) files='@(nml|NML)' ;;
    info | plot | report | watch) files='@(h5|hdf5)' ;;
    template) values=$("${COMP_WORDS[0]}" template 2>/dev/null | awk '{ print $1 }') ;;
  esac
  case $previous in
    --field | --film) values=$_asperity_fields ;;
    --history) values="$_asperity_columns energy" ;;
    --x) values=$_asperity_columns ;;
    -o | --output | --plot | --shifts | --material | --folder)
      files=
      [ "$verb" != run ] || files='@(h5|hdf5)'
      ;;
    -*)
      # The help text has the allowed words in braces, and other values in capitals.
      values=$(sed -nE "s/.*$previous \[?\{([^}]*)\}.*/\1/p" <<<"$help" | head -n 1 | tr , ' ')
      [ -n "$values" ] || ! grep -qE -- "$previous \[?[A-Z]" <<<"$help" || return
      ;;
  esac
  if [ -n "$values" ]; then
    COMPREPLY=($(compgen -W "$values" -- "$current"))
    return
  fi
  local IFS=$'\n' name extglob_was_off=
  shopt -q extglob || extglob_was_off=yes
  shopt -s extglob
  for name in $(compgen -f -- "$current"); do
    # shellcheck disable=SC2053
    if [ -d "${name/#\~/$HOME}" ] || [ -z "$files" ] || [[ $name == *.$files ]]; then
      COMPREPLY+=("$name")
    fi
  done
  [ -z "$extglob_was_off" ] || shopt -u extglob
  # Names with blanks are quoted, and folders get a slash.
  compopt -o filenames 2>/dev/null
  return 0
}
complete -F _asperity asperity
