"""The script of each shell, put together from the tree of the commands.

bash and zsh share their functions, printed here as plain tables (``case``), and differ in how they talk to the user;
fish takes one line per word.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.resources import files
from types import MappingProxyType
from typing import Final

from hil.support.completion.fish import fish_script
from hil.support.completion.tree import EVERYWHERE, Command, Parameter, Values, tree

EXPERIMENTS_OF: Final = r"""_hil_experiments() { # the experiments of a rig file
    sed -n 's/^[[:space:]]*\[experiments\.\([^].]*\)\].*/\1/p' "$1" 2>/dev/null
}"""


def script(shell: str, lines: Mapping[str, str], effects: Iterable[str]) -> str:
    """Return the completion script of a shell.

    Parameters
    ----------
    shell
        One of `SHELLS`.
    lines
        Name and line of help of every command.
    effects
        Names of the catalogue.
    """
    alone = tuple(
        Parameter((name,), text, Values.NONE)
        for name, text in (("--help", "Show the commands"), ("--version", "Print the version"))
    )
    top = Command((), "", (*EVERYWHERE, *alone), (), tuple(lines))
    commands = [top, *tree(lines)]
    return SHELLS[shell](commands, tuple(effects))


def _bash(commands: Iterable[Command], effects: tuple[str, ...]) -> str:
    return _filled("hil.bash", commands, effects)


def _zsh(commands: Iterable[Command], effects: tuple[str, ...]) -> str:
    return _filled("hil.zsh", commands, effects)


SHELLS: Final[Mapping[str, Callable[[Iterable[Command], tuple[str, ...]], str]]] = MappingProxyType(
    {"bash": _bash, "zsh": _zsh, "fish": fish_script}
)


def _filled(template: str, commands: Iterable[Command], effects: tuple[str, ...]) -> str:
    text = (files("hil.support.completion") / template).read_text(encoding="utf-8")
    return text.replace("@FUNCTIONS@", "\n\n".join(_functions(tuple(commands), effects)) + "\n")


def _functions(commands: tuple[Command, ...], effects: tuple[str, ...]) -> Iterator[str]:
    names = "|".join(f'"{command.name}"' for command in commands if command.path)
    yield f'_hil_is_command() {{\n    case "$1" in\n    {names}) return 0 ;;\n    *) return 1 ;;\n    esac\n}}'
    options = [(command.name, " ".join(_option_names(command))) for command in commands]
    yield _table("_hil_options() { # command", '"$1"', options)
    yield _table("_hil_values() { # command, option", '"$1 $2"', _values(commands, effects))
    yield _table("_hil_arguments() { # command, number of the argument", '"$1 $2"', _arguments(commands, effects))
    yield EXPERIMENTS_OF


def _table(head: str, key: str, rows: Iterable[tuple[str, str]]) -> str:
    body = "\n".join(f'    {_pattern(name)}) echo "{words}" ;;' for name, words in rows)
    return f"{head}\n    case {key} in\n{body}\n    esac\n}}"


def _pattern(name: str) -> str:
    """Quote a key, but for the star that stands for the rest."""
    return f'"{name[:-1]}"*' if name.endswith("*") else f'"{name}"'


def _option_names(command: Command) -> Iterator[str]:
    everywhere = EVERYWHERE if command.path else ()
    for option in (*command.options, *everywhere):
        yield from option.names


def _values(commands: Iterable[Command], effects: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    for command in commands:
        for option in (*command.options, *(EVERYWHERE if command.path else ())):
            if option.values is not Values.NONE:
                for name in option.names:
                    yield f"{command.name} {name}", _words(option, effects)


def _arguments(commands: Iterable[Command], effects: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    for command in commands:
        for number, argument in enumerate(command.arguments, 1):
            yield f"{command.name} {'*' if argument.repeats else number}", _words(argument, effects)
        if command.commands:
            yield f"{command.name} 1", " ".join(command.commands)


def _words(parameter: Parameter, effects: tuple[str, ...]) -> str:
    """Return the words a parameter takes, or ``@`` and the kind of thing the shell has to look for."""
    if parameter.choices:
        return " ".join(parameter.choices)
    if parameter.values is Values.EFFECTS:
        return " ".join(effects)
    return f"@{parameter.values.value}"
