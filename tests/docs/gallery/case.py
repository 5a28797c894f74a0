"""What a failure of the gallery is, and how the tool is made to tell of it."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hil.cli.main import run

Draw = Callable[[Path], None]


@dataclass(frozen=True, slots=True)
class Told:
    """What stands on the page: the command, what it printed, its exit status, and how to draw the signals."""

    command: str
    text: str
    status: int
    draw: Draw | None = None


@dataclass(frozen=True, slots=True)
class Failure:
    """One failure: ``provoke`` is called in an empty folder; ``quick`` ones are tried again by the tests."""

    name: str
    provoke: Callable[[], Told]
    quick: bool = False


_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def skeleton(text: str) -> str:
    """Return a text without its numbers: how many samples there were depends on the machine, what is said does not."""
    return _NUMBER.sub("#", text)


def tell(failure: Failure) -> Told:
    """Provoke a failure in a folder of its own, which is the current one meanwhile."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return failure.provoke()


def said(command: str, *also: str, keep: Callable[[str], bool] = lambda line: True) -> tuple[str, int]:
    """Carry out a command line as a user types it; return what it printed and its exit status.

    Parameters
    ----------
    command
        ``hil ...``.
    also
        Further words that are not shown, such as addresses.
    keep
        Which of the printed lines are shown; the others are left out, and that is marked.
    """
    printed = io.StringIO()
    with _wide(), contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        status = run([*shlex.split(command)[1:], *also])
    return "\n".join(_kept(printed.getvalue().rstrip().splitlines(), keep)), status


def _kept(lines: list[str], keep: Callable[[str], bool]) -> Iterator[str]:
    left_out = False
    for line in lines:
        if keep(line):
            if left_out:
                yield "..."
            yield line.rstrip()
        left_out = not keep(line)


@contextlib.contextmanager
def _wide() -> Iterator[None]:
    """Let what is printed be as wide as the page allows, whatever the terminal is."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = "110"
    try:
        yield
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before
