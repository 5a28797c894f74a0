"""Processes that this program starts: none of them imports a module from the folder it happens to be in.

Python looks for modules in the working folder first, for ``-m`` and ``-c`` alike: a ``pickle.py`` next to somebody's
recordings would be run. ``-P`` (PYTHONSAFEPATH) leaves that out. A process that needs no folder gets an empty one.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

VARIABLE: Final = "PYTHONSAFEPATH"

PACKAGES: Final = Path(__file__).resolve().parents[1]
"""Where the packages of this program are."""


def python(*arguments: str) -> list[str]:
    """Return the command line of a Python process with these arguments."""
    return [sys.executable, "-P", *arguments]


def environment(**more: str) -> dict[str, str]:
    """Return the environment of such a process: it finds this very program, installed or not."""
    found = [str(PACKAGES), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(found), **more}


@contextmanager
def safe_path() -> Iterator[None]:
    """Give the same to processes that ``multiprocessing`` starts in the block: it has no option for it."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before
