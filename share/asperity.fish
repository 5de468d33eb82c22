# Completion of the command asperity for fish: commands, options, and the files that each one takes.
set -l verbs run check template info plot report watch import fit friction

function __asperity_options
    # Each command lists its own options, so that the list is that of the installed version.
    set -l words (commandline -opc)
    $words[1] $words[2] --help 2>/dev/null | string match -rag -- '(--[a-z][a-z-]*)' | sort -u
end

function __asperity_files
    for name in (__fish_complete_path (commandline -ct))
        string match -qr -- "(/|\.($argv[1]))\$" $name; and echo $name
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
complete -c asperity -n "__fish_seen_subcommand_from $verbs; and string match -q -- '-*' (commandline -ct)" -a '(__asperity_options)'
complete -c asperity -n "__fish_seen_subcommand_from run check" -a '(__asperity_files nml)'
complete -c asperity -n "__fish_seen_subcommand_from info plot report watch" -a '(__asperity_files "h5|hdf5")'
complete -c asperity -n "__fish_seen_subcommand_from template" -a '(asperity template 2>/dev/null | string replace -r " .*" "")'
complete -c asperity -n "__fish_seen_subcommand_from import fit friction" -F
