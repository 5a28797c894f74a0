#compdef hil
# Completion of hil for zsh. Made by: hil completion zsh
# Put it as _hil into a folder of $fpath, or load it in ~/.zshrc, after compinit, by: source <(hil completion zsh)

@FUNCTIONS@
_hil() {
    local current="${words[CURRENT]}" option="" name="" next word kind i count=0 rig=""
    for ((i = 2; i < CURRENT; i++)); do
        word="${words[i]}"
        if [[ -n "$option" ]]; then
            option=""
        elif [[ "$word" == -* ]]; then
            [[ -n "$(_hil_values "$name" "$word")" ]] && option="$word"
        else
            next="${name:+$name }$word"
            if ((count == 0)) && _hil_is_command "$next"; then
                name="$next"
            else
                count=$((count + 1))
                ((count == 1)) && rig="$word"
            fi
        fi
    done
    if [[ -n "$option" ]]; then
        kind="$(_hil_values "$name" "$option")"
    elif [[ "$current" == -* ]]; then
        kind="$(_hil_options "$name")"
    else
        kind="$(_hil_arguments "$name" $((count + 1)))"
    fi
    case "$kind" in
    "@files") _files ;;
    "@experiments") compadd -- ${(f)"$(_hil_experiments "$rig")"} ;;
    "@any") ;;
    *) compadd -- ${=kind} ;;
    esac
}

if [[ "${funcstack[1]}" == _hil ]]; then
    _hil "$@"
else
    compdef _hil hil
fi
