"""Names that one file gives to others: they lead nowhere but into the folder they are relative to.

A set of cases, a run store, a commissioning, a rig file may be someone else's. An absolute path in it, one through
``..`` or through a symbolic link would have this program read, show, pack or delete what is none of theirs.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

PLAIN: Final = r"[A-Za-z0-9_][A-Za-z0-9_.+-]*"
"""A name of one part, the same on every system."""

_PLAIN_NAME: Final = re.compile(PLAIN)


def is_plain(name: object) -> bool:
    """Whether something is the name of a file or folder of one part, without a leading dot."""
    return isinstance(name, str) and _PLAIN_NAME.fullmatch(name) is not None


def is_inside(folder: Path, path: Path) -> bool:
    """Whether a path, symbolic links followed, is in a folder or one below it; neither has to be there."""
    try:
        home, found = folder.resolve(), path.resolve()
        found.exists()
    except (OSError, RuntimeError, ValueError):  # a loop of links, a NUL in the name, or more than a name can have
        return False
    return found != home and found.is_relative_to(home)


def inside(folder: Path, name: str) -> Path:
    """Return the path of a name that is relative to a folder.

    Raises
    ------
    ValueError
        If it leads out of the folder: what was expected, without what came.
    """
    path = folder / name
    if not is_inside(folder, path):
        raise ValueError(f"the name of a file inside {folder}, none that leads out of it")
    return path
