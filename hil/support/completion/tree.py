"""What can be completed: the commands with their options and arguments, as the commands themselves declare them."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final, get_args, get_type_hints

import typer

from hil.cli.call import LOG_LEVEL, QUIET
from hil.support.command_log import LEVELS


class Values(Enum):
    """What an option or argument takes, where it is no list of words."""

    NONE = "none"  # a flag
    ANY = "any"
    FILES = "files"
    EFFECTS = "effects"
    EXPERIMENTS = "experiments"


@dataclass(frozen=True, slots=True)
class Parameter:
    """An option or an argument: ``values`` says what it takes, ``choices`` are its words where there are some."""

    names: tuple[str, ...]
    help: str
    values: Values
    choices: tuple[str, ...] = ()
    repeats: bool = False


@dataclass(frozen=True, slots=True)
class Command:
    """One command: ``path`` is its name, with that of its group before it; a group has ``commands``."""

    path: tuple[str, ...]
    help: str
    options: tuple[Parameter, ...]
    arguments: tuple[Parameter, ...]
    commands: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The path as it is typed."""
        return " ".join(self.path)


EVERYWHERE: Final = (
    Parameter((QUIET,), "Print errors only", Values.NONE),
    Parameter((LOG_LEVEL,), "What the log keeps", Values.ANY, LEVELS),
)
"""Options of every command."""


def tree(lines: Mapping[str, str]) -> tuple[Command, ...]:
    """Return every command, a group before its own; ``lines`` has the name and the line of help of each."""
    return tuple(
        found
        for name, line in lines.items()
        for found in _walk((name,), typer.main.get_command(importlib.import_module(f"hil.cli.{name}").app), line)
    )


def _walk(path: tuple[str, ...], command: Any, line: str) -> Iterator[Command]:
    inner: Mapping[str, Any] = getattr(command, "commands", {})
    types = _types(command.callback)
    options = [_parameter(path, each, types) for each in command.params if each.param_type_name == "option"]
    arguments = [_parameter(path, each, types) for each in command.params if each.param_type_name == "argument"]
    shown = Parameter(("--help",), "Show its help", Values.NONE)
    yield Command(path, line, (*options, shown), tuple(arguments), tuple(inner))
    for name, each in inner.items():
        yield from _walk((*path, name), each, _sentence(each.help))


def _types(callback: Callable[..., Any] | None) -> Mapping[str, Any]:
    return {} if callback is None else get_type_hints(inspect.unwrap(callback))


def _parameter(path: tuple[str, ...], given: Any, types: Mapping[str, Any]) -> Parameter:
    kinds = _kinds(types.get(given.name))
    choices = tuple(str(member.value) for kind in kinds if issubclass(kind, Enum) for member in kind)
    names = tuple(name for name in given.opts if name.startswith("--")) or tuple(given.opts)
    return Parameter(
        names,
        _sentence(getattr(given, "help", None)),
        _values(path, given, kinds),
        choices,
        repeats=given.nargs != 1 or bool(getattr(given, "multiple", False)),
    )


def _kinds(hint: Any) -> tuple[type, ...]:
    """Return the classes a type is made of: of ``list[Path] | None`` Path alone."""
    inner = get_args(hint)
    if not inner:
        return (hint,) if isinstance(hint, type) and hint is not type(None) else ()
    return tuple(kind for part in inner for kind in _kinds(part))


def _values(path: tuple[str, ...], given: Any, kinds: tuple[type, ...]) -> Values:
    if getattr(given, "is_flag", False):
        return Values.NONE
    if given.name == "effect" or (path, given.name) == (("effects",), "name"):
        return Values.EFFECTS
    if given.name == "experiment":
        return Values.EXPERIMENTS
    return Values.FILES if Path in kinds else Values.ANY


def _sentence(text: str | None) -> str:
    """Return the first sentence of a help text, on one line, as short as it is."""
    words = " ".join((text or "").split())
    return words.partition(". ")[0].partition(";")[0].rstrip(".")
