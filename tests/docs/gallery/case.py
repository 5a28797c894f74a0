"""What a failure of the gallery is, and how the tool is made to tell of it."""

import contextlib
import io
import os
import re
import shlex
import tempfile
import textwrap
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hil.cli.main import run

Draw = Callable[[Path], None]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What stands on the page: the command, what it printed, its exit status, and how to draw the signals."""

    command: str
    text: str
    status: int
    draw: Draw | None = None


@dataclass(frozen=True, slots=True)
class Failure:
    """One failure: ``provoke`` is called in an empty folder; ``quick`` ones are tried again by the tests."""

    name: str
    provoke: Callable[[], Outcome]
    quick: bool = False


WIDTH = 84
"""Characters of a line in a block of the built page."""

_PARAGRAPH = re.compile(r"(?! )(?:[A-Za-z]+: |[A-Za-z' ]+  )")
"""How a line begins that is a statement of its own, ``Note: ...``, or the row of a table, ``dry friction  ...``."""

_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def skeleton(text: str) -> str:
    """Return a text without its numbers and spacing: those depend on the machine, what is said does not."""
    return re.sub(r"\s+", " ", _NUMBER.sub("#", text))


def tell(failure: Failure) -> Outcome:
    """Provoke a failure in a folder of its own, which is the current one meanwhile."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return failure.provoke()


def said(command: str, *also: str, only: tuple[str, ...] = (), without: str = "") -> tuple[str, int]:
    """Carry out a command line as a user types it; return what it printed and its exit status."""
    printed = io.StringIO()
    with _wide(), contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        status = run([*shlex.split(command)[1:], *also])
    lines = re.sub(without, "", printed.getvalue()).rstrip().splitlines()
    return "\n".join(_wrapped(_chosen(lines, only) if only else lines)), status


def _chosen(lines: list[str], only: tuple[str, ...]) -> Iterator[str]:
    """Yield the paragraphs that begin so, with ``...`` in the place of others; the terminal has wrapped them."""
    shown = left_out = False
    for line in lines:
        if _PARAGRAPH.match(line):
            shown = line.startswith(only)
        if shown and left_out:
            yield "..."
        left_out = not shown
        if shown:
            yield line


def _wrapped(lines: Iterable[str]) -> Iterator[str]:
    for line in lines:
        yield from textwrap.wrap(line, WIDTH) if len(line) > WIDTH else [line.rstrip()]


@contextlib.contextmanager
def _wide() -> Iterator[None]:
    """Let what is printed be as wide as the page allows, whatever the terminal is."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = str(WIDTH)
    try:
        yield
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before
