"""Files of others and for others: names that lead nowhere else, JSON, and writing whole or not at all."""

from __future__ import annotations

import json
import os
import platform
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from drivers.foreign_file import read_regular
from hil.errors import UsageError

PLAIN: Final = r"[A-Za-z0-9_][A-Za-z0-9_.+-]*"
"""A name of one part, the same on every system."""

_PLAIN_NAME: Final = re.compile(PLAIN)

LARGEST_BYTES: Final = 32 << 20
"""Longest file that is read: empty lists alone then take 0.7 GiB."""

_HOST: Final = f"{zlib.crc32(platform.node().encode()):08x}"
_PART: Final = re.compile(r"\..+\.(?P<host>[0-9a-f]{8})-(?P<process>[0-9]+)\.part(\.json)?")


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
    """Return the path of a name that is relative to a folder."""
    path = folder / name
    if not is_inside(folder, path):
        raise ValueError(f"the name of a file inside {folder}, none that leads out of it")
    return path


def read_json(path: Path) -> Any:
    """Return what a JSON file says."""
    return parse_json(read_regular(path, LARGEST_BYTES).decode("utf-8"))


def parse_json(text: str) -> Any:
    """Return what a JSON text says."""
    try:
        return json.loads(text, parse_int=_of_64_bit)
    except RecursionError:
        raise ValueError("values nested too deep") from None


def _of_64_bit(digits: str) -> int:
    """Return a whole number; a longer one is none of a count, and fits no float where it is divided."""
    value = int(digits)
    if not -(1 << 63) <= value < 1 << 63:
        raise ValueError(f"a whole number of {len(digits)} digits, expected at most 64 bit")
    return value


def part_of(path: Path) -> Path:
    """Name what this process has not finished yet of a file."""
    return path.with_name(f".{path.name}.{_HOST}-{os.getpid()}.part")


@contextmanager
def whole(path: Path, *, new: bool = False) -> Iterator[Path]:
    """Give the hidden name to write to; the file gets its own when the block ends, and nothing stays if it fails."""
    part = part_of(path)
    try:
        yield part
        _sync(part)
        if new:
            _name_new(part, path)
        else:
            part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def write_whole(path: Path, content: str | bytes, *, new: bool = False) -> None:
    """Write a file, whole or not at all, text in UTF-8; see `whole`."""
    with whole(path, new=new) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)


def _sync(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _name_new(part: Path, path: Path) -> None:
    """Name a file, unless there is one: by a link, or where the disk has none, by taking the name first."""
    try:
        os.link(part, path)
    except FileExistsError:
        raise
    except OSError:
        path.open("xb").close()
        part.replace(path)


def remove_abandoned(folder: Path) -> list[Path]:
    """Remove the unfinished files of processes of this computer that were killed while they wrote into a folder."""
    removed = []
    for entry in sorted(folder.iterdir()):
        found = _PART.fullmatch(entry.name)
        if found and found["host"] == _HOST and not _runs(int(found["process"])):
            entry.unlink(missing_ok=True)
            removed.append(entry)
    return removed


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:  # it is another user's
        return True
    return True


def refuse_existing(path: Path) -> None:
    """Refuse a file that is there, before anything is asked."""
    if path.exists():
        raise UsageError(f"{path}: expected a new file, got one that is there. Give another name, or move it away.")


def write_new(path: Path, content: str | bytes) -> None:
    """Write a file that a person asked for under a name that is free; a `UsageError` where it is not, or can't be."""
    try:
        write_whole(path, content, new=True)
    except FileExistsError as cause:
        raise UsageError(f"{path}: expected a new file, got one that is there") from cause
    except OSError as cause:
        raise UsageError(f"{path}: expected a place to write to, got: {cause.strerror}. Give another.") from cause
