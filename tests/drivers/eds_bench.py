"""The shipped EDS with texts replaced, for the tests of its checker."""

import re
from pathlib import Path

from drivers.datasheet.text import Severity
from drivers.eds_check import EdsReport, check_eds
from drivers.resources import data_file

E, W, N = Severity.ERROR, Severity.WARNING, Severity.NOTE

SHIPPED = data_file("inverter.eds").read_text()


def checked(folder: Path, text: str) -> EdsReport:
    path = folder / "file.eds"
    path.write_text(text)
    return check_eds(path)


def edited(section: str, old: str, new: str, *, text: str = SHIPPED) -> str:
    """Replace text, which must be there once, inside one section, header included; keys begin after a line end."""
    pattern = re.compile(rf"^\[{section}\]\n(?:(?!\[)[^\n]*\n)*", re.MULTILINE)
    (found,) = pattern.finditer(text)
    assert found[0].count(old) == 1, f"{old!r} is {found[0].count(old)} times in [{section}]"
    return text[: found.start()] + found[0].replace(old, new) + text[found.end() :]


def without(section: str, text: str = SHIPPED) -> str:
    """Take out a section and its sub-indices."""
    text, times = re.subn(rf"(?m)^\[{section}(sub\w+)?\]\n(?:(?!\[)[^\n]*\n)*", "", text)
    assert times
    return text


def line_of(text: str, section: str, key: str = "") -> int:
    """Find the line of a section, or of a key inside it."""
    lines = text.split("\n")
    start = lines.index(f"[{section}]")
    if not key:
        return start + 1
    return next(n for n, line in enumerate(lines) if n > start and line.startswith(f"{key}=")) + 1
