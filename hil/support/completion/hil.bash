# Completion of hil for bash, 3.2 and later. Made by: hil completion bash
# Put it into ~/.local/share/bash-completion/completions/hil, or load it in ~/.bashrc by: source <(hil completion bash)

@FUNCTIONS@
_hil() {
    local current="${COMP_WORDS[COMP_CWORD]}" option="" path="" next word kind i count=0 rig=""
    for ((i = 1; i < COMP_CWORD; i++)); do
        word="${COMP_WORDS[i]}"
        if [[ -n "$option" ]]; then
            option=""
        elif [[ "$word" == -* ]]; then
            [[ -n "$(_hil_values "$path" "$word")" ]] && option="$word"
        elif [[ "$word" != = && "$word" != : ]]; then
            next="${path:+$path }$word"
            if ((count == 0)) && _hil_is_command "$next"; then
                path="$next"
            else
                count=$((count + 1))
                ((count == 1)) && rig="$word"
            fi
        fi
    done
    if [[ -n "$option" ]]; then
        kind="$(_hil_values "$path" "$option")"
    elif [[ "$current" == -* ]]; then
        kind="$(_hil_options "$path")"
    else
        kind="$(_hil_arguments "$path" $((count + 1)))"
    fi
    COMPREPLY=()
    case "$kind" in
    "@files") compopt -o default 2>/dev/null ;;
    "@experiments") COMPREPLY=($(compgen -W "$(_hil_experiments "$rig")" -- "$current")) ;;
    "@any") ;;
    *) COMPREPLY=($(compgen -W "$kind" -- "$current")) ;;
    esac
}

complete -F _hil hil
