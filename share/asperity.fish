# Completion of the command asperity for fish: commands, options and their values, and files.
set -l verbs run check template info plot report watch import fit friction

function __asperity_fields
    printf '%s\n' pressure gap displacement_z contact road_height traction_x traction_y \
        displacement_x displacement_y slip_x slip_y
end

function __asperity_columns
    printf '%s\n' step phase time pressure force displacement contact_area mean_gap road_x road_y \
        traction_x traction_y stick_area sliding_speed friction_viscous friction work_normal \
        work_tangential work_load work_drive work_missing energy_elastic energy_adhesive \
        energy_kinetic energy_radiated dissipated_viscous dissipated_numerical \
        dissipated_friction power_viscous power_friction iterations_normal \
        iterations_tangential residual_normal residual_tangential passes residual_coupling ffts \
        seconds
end

# Files with the given endings, and folders.
function __asperity_files
    set -l typed (commandline -ct | string unescape)
    # Each name is followed by a tab, behind which there could be a description.
    for name in (__fish_complete_path "$typed" | string replace -r '\t.*' '')
        string match -qr -- "(/|$argv[1])\$" $name; and echo $name
    end
end

# What can follow the words in the command line.
function __asperity_words
    set -l words (commandline -opc)
    set -l verb $words[2]
    set -l previous $words[-1]
    # Each command lists its own options, so that the list is that of the installed version.
    if string match -q -- '-*' (commandline -ct)
        $words[1] $verb --help 2>/dev/null | string match -rag -- '(--[a-z][a-z-]*)' | sort -u
        return
    end
    switch $previous
        case --field --film
            __asperity_fields
            return
        case --history
            __asperity_columns
            echo energy
            return
        case --x
            __asperity_columns
            return
        case -o --output --plot --shifts --material --folder
            if test $verb = run
                __asperity_files '\.(h5|hdf5)'
            else
                __asperity_files '.*'
            end
            return
        case '-*'
            # The help text has the allowed words in braces, and other values in capitals.
            set -l help ($words[1] $verb --help 2>/dev/null)
            set -l values (string match -rg -- $previous' \[?\{([^}]*)\}' $help)
            if set -q values[1]
                string split , $values[1]
                return
            end
            string match -qr -- $previous' \[?[A-Z]' $help; and return
    end
    switch $verb
        case run check
            __asperity_files '\.nml'
        case info plot report watch
            __asperity_files '\.(h5|hdf5)'
        case template
            $words[1] template 2>/dev/null | string replace -r " .*" ""
        case '*'
            __asperity_files '.*'
    end
end

complete -c asperity -f
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a run -d 'Run a case'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a check -d 'Check an input'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a template -d 'Print an input'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a info -d 'What a file holds'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a plot -d 'Draw a result'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a report -d 'Write a page'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a watch -d 'Follow a run'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a import -d 'Read a topography'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a fit -d 'Fit a material'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -a friction -d 'Friction curves'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -l help -d 'Print help'
complete -c asperity -n "not __fish_seen_subcommand_from $verbs" -l version -d 'Print the version'
complete -c asperity -n "__fish_seen_subcommand_from $verbs" -a '(__asperity_words)'
