"""What is known of recordings from the last survey: by size, time and head of a file, or by an address's ETag.

``DATASET/survey.parquet`` has a row for each recording: its stamp, its checksum, and what it says of itself. So the
call of every night reads what is new, and of the rest its first bytes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from drivers.foreign_file import open_regular, require_regular
from hil.fleet.dataset import SURVEY, DatasetRow, read
from hil.fleet.sources import REMOTE, Seen, remote_sidecar
from hil.recording.description import sidecar_of

HEAD_BYTES = 4096

_CONTENTS = ("etag", "md5hash", "md5", "content_md5", "crc32c", "crc", "checksum")
_TIMES = ("lastmodified", "last_modified", "mtime", "updated", "modified", "created", "date_time")
"""What file systems of fsspec call what changes with a file, in small letters."""


class Survey:
    """What is known of recordings, by their paths and addresses."""

    def __init__(self, rows: list[DatasetRow]) -> None:
        self._rows: dict[str, DatasetRow] = {row["url"]: row for row in rows}

    @classmethod
    def of(cls, folder: Path) -> Survey:
        """Read that of a dataset; empty where there is none."""
        return cls(read(folder, SURVEY.removesuffix(".parquet")))

    def seen(self, url: str, stamp: str) -> Seen | None:
        """Return what is known of a recording that has not changed since; None of another."""
        row = self._rows.get(url)
        if not stamp or row is None or row["stamp"] != stamp:
            return None
        return Seen(row["sha256"], row["said_vehicle"], row["said_rig"], row["said_started"])

    def note(self, url: str, stamp: str, seen: Seen) -> None:
        """Keep what was read of a recording; the stamp is from before it was read."""
        said = asdict(seen)
        self._rows[url] = {"url": url, "stamp": stamp, "sha256": said.pop("sha256")} | {
            f"said_{name}": text for name, text in said.items()
        }

    def rows(self) -> list[DatasetRow]:
        """Return all of it, as the dataset keeps it."""
        return list(self._rows.values())


def stamp(url: str) -> str:
    """Return what changes with a recording and its sidecar; empty where nothing tells."""
    try:
        return _of_address(url) if REMOTE in url else _of_file(Path(url))
    except Exception:  # noqa: BLE001 - each file system of fsspec has errors of its own; reading it will name this one
        return ""


def _of_file(path: Path) -> str:
    said = []
    for each in (path, sidecar_of(path)):
        if each == path or each.exists():
            about = require_regular(each)
            with open_regular(each) as file:
                head = hashlib.sha256(file.read(HEAD_BYTES)).hexdigest()
            said.append(f"{about.st_size} {about.st_mtime_ns} {head}")
    return ", ".join(said)


def _of_address(url: str) -> str:
    from fsspec.core import url_to_fs

    fs, path = url_to_fs(url)
    said = [_of_information(fs.info(path))]
    if "" in said:
        return ""
    if fs.exists(remote_sidecar(path)):
        said.append(_of_information(fs.info(remote_sidecar(path))))
    return "" if "" in said else ", ".join(said)


def _of_information(about: Mapping[str, Any]) -> str:
    """Return what a file system says that changes with a file, besides its size; empty where it says nothing."""
    named = {name.lower(): value for name, value in about.items() if value is not None}
    changing = [f"{name} {named[name]}" for name in (*_CONTENTS, *_TIMES) if name in named]
    return " ".join([str(named.get("size", "")), *changing]) if changing else ""
