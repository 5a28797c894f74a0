"""docs/reference-commands.md, written from the commands themselves.

Run it to bring the page up to date: ``python -m tests.docs.commands_page``.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any, Final, get_args

import typer

from hil.cli.command_line import COMMANDS
from hil.cli.group import root
from hil.cli.main import ExitStatus
from tests.cli.command_lines import command, examples

PAGE = Path(__file__).parents[2] / "docs" / "reference-commands.md"

READ_MORE = {
    "demo": "how-good",
    "prove": "how-good",
    "sim": "get-started",
    "check": "first-time-on-a-vehicle",
    "commission": "commissioning",
    "run": "first-time-on-a-vehicle",
    "monitor": "monitor",
    "replay": "monitoring",
    "convert": "formats",
    "look": "from-your-logger",
    "runs": "run-store",
    "identify": "identification",
    "paper": "paper",
    "diagnose": "diagnosis",
    "design": "design",
    "design damper": "damping",
    "solve": "design",
    "effects": "catalogue",
    "rig": "support",
    "model": "from-your-logger",
    "completion": "support",
    "bugreport": "support",
    "export": "plc-export",
    "fleet": "fleet",
}
"""The page that tells the rest of a command."""

STATUSES = {
    ExitStatus.DONE: "done; a verdict is a result, whatever it says",
    ExitStatus.BAD_INPUT: "wrong use or unreadable input; the message names file, line or key, what was expected, "
    "what was found",
    ExitStatus.DEVICE_FAULT: "a device or the bus is at fault, or the vehicle is not fit for the run",
    ExitStatus.REFUSED_BY_GUARD: "the torque guard refused a torque",
    ExitStatus.INTERRUPTED: "interrupted",
}

KINDS: Final = {float: "NUMBER", int: "NUMBER", str: "TEXT", Path: "FILE"}

TOP = """# Commands

Written from the commands themselves by `python -m tests.docs.commands_page`; a test compares. At the terminal
`--help` after a command says the same. What stands in square brackets may be left out.
"""


def page() -> str:
    """Return the page's text."""
    shared = _shared()
    parts = [TOP, *_map(), *_everywhere(shared), *_statuses()]
    for name in COMMANDS:
        parts += _section(name, shared)
    return "\n".join(parts).rstrip() + "\n"


def _map() -> Iterator[str]:
    yield from (", ".join(f"[{name}](#hil-{name.replace(' ', '-')})" for name in COMMANDS), "")


def _shared() -> set[str]:
    """Return the lines of options that three commands or more have in common, of each at most one: given once."""
    own = [command(name) for name in COMMANDS]
    parts = [part for each in own for part in (each, *getattr(each, "commands", {}).values())]
    lines = Counter(line for part in parts for line in set(map(_option, _options(part))))
    rare_first = [line for line, n in reversed(lines.most_common()) if n > 2]
    return set({line.split("`")[1].split()[0]: line for line in rare_first}.values())


def _everywhere(shared: set[str]) -> Iterator[str]:
    yield from ("## Options of every command", "")
    yield "- `--help`: Show this and exit; after a command: its own help, with an example."
    yield from (f"- {_names(each)}: {_cell(each.help)}" for each in typer.main.get_command(root).params)
    yield from ("", "## Options of several commands", "", "A command that has one names it after *also*.", "")
    yield from (sorted(shared))
    yield ""


def _statuses() -> Iterator[str]:
    yield from ("## Exit status", "", "| status | means |", "| --- | --- |")
    yield from (f"| {status.value} | {STATUSES[status]} |" for status in ExitStatus)
    yield from (
        "",
        "Torque is zero and the drives are disarmed on every way out; if a drive can't confirm it, a message says so.",
        "",
    )


def _section(name: str, shared: set[str]) -> Iterator[str]:
    own = command(name)
    inner = getattr(own, "commands", {})
    yield from (f"## hil {name}", "")
    yield from _in_words(f"hil {name}", own, bool(inner), shared)
    if name in READ_MORE:
        yield from (f"More: [{READ_MORE[name]}]({READ_MORE[name]}.md).", "")
    for each, part in inner.items():
        yield from (f"### hil {name} {each}", "")
        yield from _in_words(f"hil {name} {each}", part, False, shared)


def _in_words(name: str, given: Any, group: bool, shared: set[str]) -> Iterator[str]:
    """Yield usage, text, arguments, options and examples of one command."""
    arguments = [each for each in given.params if each.param_type_name == "argument"]
    options = [(each, _option(each)) for each in _options(given)]
    usage = [name, *(["[OPTIONS]"] if options else []), *map(_sign, arguments), *(["COMMAND"] if group else [])]
    yield from ("```text", " ".join(usage), "```", "", _text(given.help), "")
    yield from (f"- `{_sign(each)}`: {_cell(each.help or '')}" for each in arguments)
    yield from (line for _, line in options if line not in shared)
    if also := [f"`{each.opts[0]}`" for each, line in options if line in shared]:
        yield f"- also {', '.join(also)}"
    yield ""
    if shown := examples(given.epilog or ""):
        yield from ("```sh", *(line.rstrip(".;") for line in shown), "```", "")


def _options(given: Any) -> list[Any]:
    return [each for each in given.params if each.param_type_name == "option"]


def _option(option: Any) -> str:
    """Return the line of an option: its names, what it means, and its default."""
    default = _default(option)
    return f"- {_names(option)}: {_cell(option.help or '')}" + (f" Default: {default}." if default else "")


def _sign(argument: Any) -> str:
    metavar = argument.metavar or argument.name.upper()
    if argument.nargs != 1 and not metavar.rstrip("]").endswith("..."):
        metavar += "..."
    return metavar if argument.required or metavar.startswith("[") else f"[{metavar}]"


def _names(option: Any) -> str:
    takes = "" if option.is_flag else f" {option.metavar or _kind(option)}"
    names = ", ".join(f"`{name}{takes}`" for name in (*option.opts, *option.secondary_opts))
    return names + (", repeatable" if option.multiple else "") + (", needed" if option.required else "")


def _kind(option: Any) -> str:
    """Return what an option takes where it does not say so itself: its choices, or the kind of value."""
    annotation = option.type_descriptor.annotation
    kind = next(each for each in get_args(annotation) or (annotation,) if each is not type(None))
    return "|".join(str(each.value) for each in kind) if issubclass(kind, Enum) else KINDS[kind]


def _default(option: Any) -> str:
    value = option.default
    if value in (None, False, (), "") or value == [] or option.required:
        return ""
    return f"`{option.opts[0] if value is True else getattr(value, 'value', value)}`"


def _text(words: str | None) -> str:
    """Return a help text as paragraphs of one line each."""
    parts = (words or "").replace("\b\n", "").strip().split("\n\n")
    return "\n\n".join(_escaped(" ".join(part.split())) for part in parts)


def _cell(text: str) -> str:
    return _escaped(" ".join(text.split()))


def _escaped(text: str) -> str:
    for sign in "<>*_":
        text = text.replace(sign, f"\\{sign}")
    return text


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    sys.stdout.write(f"{PAGE}: {len(COMMANDS)} commands\n")
