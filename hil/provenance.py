"""What a result was made from: program, date, command, and the files with their checksums.

The checksums are SHA-256 of the files as they are, so that ``sha256sum`` shows the same.
"""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.foreign_file import open_regular
from hil.version import program

_LINE: ContextVar[tuple[str, ...]] = ContextVar("_LINE", default=())


@contextmanager
def under(line: Sequence[str]) -> Iterator[None]:
    """Let results that are made inside say that this command line made them."""
    token = _LINE.set(tuple(line))
    try:
        yield
    finally:
        _LINE.reset(token)


@dataclass(frozen=True, slots=True)
class Source:
    """A file that took part: its path as it was given, and its SHA-256."""

    file: str  # as it was given, not made absolute
    sha256: str  # hexadecimal

    @classmethod
    def of(cls, path: Path) -> Source:
        """Take the checksum of a file."""
        with open_regular(path) as stream:
            return cls(str(path), hashlib.file_digest(stream, "sha256").hexdigest())


@dataclass(frozen=True, slots=True)
class Provenance:
    """What a result was made from."""

    program: str  # with version and commit: hil 0.3.0 (1a2b3c4d5e6f)
    date: str  # ISO 8601, UTC
    command: str  # the command line; empty from Python
    models: tuple[Source, ...]  # model files
    recordings: tuple[Source, ...]  # in the order in which they were given
    rig: str = ""  # name of the rig that was recorded, where that is known

    def document(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {key: value for key, value in asdict(self).items() if key != "rig" or value}


def provenance(models: Sequence[Path] = (), recordings: Sequence[Path] = (), rig: str = "") -> Provenance:
    """Return what a result is made from that these files go into, now."""
    now = datetime.now(UTC).isoformat(timespec="seconds")
    line = shlex.join(("hil", *_LINE.get())) if _LINE.get() else ""
    return Provenance(program(), now, line, tuple(map(Source.of, models)), tuple(map(Source.of, recordings)), rig)
