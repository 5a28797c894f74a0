"""The script of fish: one line per word, each with the condition under which it is offered."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from hil.support.completion.tree import EVERYWHERE, Command, Parameter, Values

HEAD = r"""# Completion of hil for fish. Made by: hil completion fish
# Put it into ~/.config/fish/completions/hil.fish

function __hil_experiments
    for word in (commandline -opc)
        if test -f $word
            sed -n 's/^[[:space:]]*\[experiments\.\([^].]*\)\].*/\1/p' $word
        end
    end
end

function __hil_has_rig
    count (__hil_experiments) >/dev/null
end
"""


def fish_script(commands: Iterable[Command], effects: tuple[str, ...]) -> str:
    """Return the script."""
    found = list(commands)
    lines = [line for command in found for line in _lines(command, effects)]
    common = [line for option in EVERYWHERE for line in _option("", option, effects)]
    return "\n".join([HEAD, *common, *lines]) + "\n"


def _lines(command: Command, effects: tuple[str, ...]) -> Iterator[str]:
    condition = _condition(command)
    if not command.path:
        for option in command.options:
            if option not in EVERYWHERE:
                yield from _option(condition, option, effects)
        return
    yield f"complete -c hil {_when(_parent(command))} -f -a {command.path[-1]} -d {_quoted(command.help)}"
    for option in command.options:
        yield from _option(condition, option, effects)
    for argument in command.arguments:
        words = _words(argument, effects)
        if words:
            yield f"complete -c hil {_when(condition)} -f -a {_quoted(words)}"
        if argument.values is Values.FILES:
            yield f"complete -c hil {_when(condition + _while_no_rig(command))} -F"


def _while_no_rig(command: Command) -> str:
    """Return the further condition under which files are offered where experiments follow the rig file."""
    follow = any(argument.values is Values.EXPERIMENTS for argument in command.arguments)
    return "; and not __hil_has_rig" if follow else ""


def _option(condition: str, option: Parameter, effects: tuple[str, ...]) -> Iterator[str]:
    words = _words(option, effects)
    takes = {Values.NONE: "", Values.FILES: " -r -F"}.get(option.values, " -x")
    given = f" -a {_quoted(words)}" if words else ""
    for name in option.names:
        yield f"complete -c hil {_when(condition)} -l {name.removeprefix('--')}{takes}{given} -d {_quoted(option.help)}"


def _words(parameter: Parameter, effects: tuple[str, ...]) -> str:
    if parameter.choices:
        return " ".join(parameter.choices)
    if parameter.values is Values.EXPERIMENTS:
        return "(__hil_experiments)"
    return " ".join(effects) if parameter.values is Values.EFFECTS else ""


def _parent(command: Command) -> str:
    """Return the condition under which the command itself is offered."""
    if len(command.path) == 1:
        return "__fish_use_subcommand"
    return f"__fish_seen_subcommand_from {command.path[0]}; and not __fish_seen_subcommand_from {command.path[1]}"


def _condition(command: Command) -> str:
    """Return the condition under which what belongs to the command is offered."""
    if not command.path:
        return "__fish_use_subcommand"
    return "; and ".join(f"__fish_seen_subcommand_from {name}" for name in command.path)


def _when(condition: str) -> str:
    return f"-n {_quoted(condition)}" if condition else ""


def _quoted(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
