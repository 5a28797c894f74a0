"""The recordings of a fleet: files, folders, globs and Parquet datasets, here or behind a URL of fsspec.

A recording belongs to a vehicle and a rig: as the pattern of the path says; else a Parquet dataset's folders
(``vehicle=7/rig=a``); else the recording's own metadata (``vehicle``, the name in its rig file); else its folder.

A name on this machine is a name, whatever is in it, ``::`` for one; it is a glob only where nothing is called so.
"""

from __future__ import annotations

import glob
import hashlib
import os
import re
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from hil.errors import RecordingError, UsageError
from hil.fleet.dataset import FAILURES, RESULTS, SURVEY
from hil.provenance import Source
from hil.recording.checksum import RIG_TEXT
from hil.recording.description import sidecar_of
from hil.recording.formats import is_named_as_recording, read_metadata

REMOTE, CHAIN = "://", "::"

GROUPS = ("vehicle", "rig", "started")
"""What a pattern may take from a path; all but the last are named by a Parquet dataset's folders as well."""

_FOLDER = re.compile(r"(?:^|/)(vehicle|rig)=([^/]+)(?=/)")


@dataclass(frozen=True, slots=True)
class Seen:
    """What a recording's file says of itself: kept, so that one that is known is not read again."""

    sha256: str  # of its content, and of the sidecar that belongs to it
    vehicle: str = ""  # empty where the file does not say
    rig: str = ""  # name in the rig file that it was recorded with; empty without one
    started: str = ""  # ISO 8601


@dataclass(frozen=True, slots=True)
class FleetRecording:
    """A recording of the fleet, by its path or its address of fsspec; the rest is empty where nothing says it."""

    url: str  # absolute path, or address
    vehicle: str = ""  # from the path; else what the file says, else rig or folder
    rig: str = ""  # from the path, else what the file says
    started: str = ""  # ISO 8601
    sha256: str = ""  # as `Seen` has it; empty before the file was read

    @property
    def name(self) -> str:
        """The name of the file."""
        return PurePosixPath(self.url).name

    def seen_as(self, seen: Seen) -> FleetRecording:
        """Return it with what its file says, where the path has not said it."""
        rig = self.rig or seen.rig
        vehicle = self.vehicle or seen.vehicle or rig or PurePosixPath(self.url).parent.name
        return replace(self, vehicle=vehicle, rig=rig, started=self.started or seen.started, sha256=seen.sha256)


def in_order(text: str) -> list[tuple[str, int, str]]:
    """Return by what names are sorted as people count: bus_2 before bus_10."""
    return [(words, len(digits), digits) for words, digits in re.findall("([^0-9]*)0*([0-9]*)", text)]


def pattern_of(text: str | None) -> re.Pattern[str] | None:
    """Return a pattern that was given for the paths."""
    if text is None:
        return None
    try:
        pattern = re.compile(text)
    except re.error as error:
        raise UsageError(f"--pattern: expected a regular expression, got {text!r}: {error}") from error
    if not set(pattern.groupindex) & set(GROUPS) or set(pattern.groupindex) - set(GROUPS):
        raise UsageError(
            f"--pattern: expected groups of the names {', '.join(GROUPS)}, as in (?P<vehicle>bus_[0-9]+), got {text!r}"
        )
    return pattern


def find(sources: Sequence[str], pattern: re.Pattern[str] | None) -> tuple[list[FleetRecording], list[str]]:
    """Return the recordings that sources name, in their order, and what is wrong with the other sources."""
    found: dict[str, FleetRecording] = {}
    complaints: list[str] = []
    for source in sources:
        try:
            urls = _elsewhere(source) if REMOTE in source else _here(source)
        except Exception as error:  # noqa: BLE001 - each file system of fsspec has errors of its own
            complaints.append(f"{source}: expected files that can be listed, got: {_error_text(error)}")
            continue
        if not urls:
            complaints.append(f"{source}: expected recordings, got none")
        found.update((url, _placed(url, pattern)) for url in sorted(urls))
    return list(found.values()), complaints


def _here(source: str) -> list[str]:
    """Return the files of a name on this machine."""
    root = os.path.abspath(os.path.expanduser(source))
    if os.path.isdir(root):
        return [path for path in _below(root) if _is_recording(path, root)]
    if os.path.lexists(root):
        return [root]
    if not glob.has_magic(root):
        raise FileNotFoundError("no such file or folder")
    return [path for path in glob.glob(root, recursive=True) if not os.path.isdir(path)]


def _below(root: str) -> Iterator[str]:
    """Yield the files below a folder; links are followed, none of them in a circle."""
    visited = set()
    for folder, folders, files in os.walk(root, followlinks=True):
        about = os.stat(folder)
        if (about.st_dev, about.st_ino) in visited:
            folders.clear()
            continue
        visited.add((about.st_dev, about.st_ino))
        yield from (os.path.join(folder, file) for file in files)


def _elsewhere(source: str) -> list[str]:
    """Return the files of an address of fsspec; where it is a chain (``zip://*.csv::file:///x.zip``), each as one."""
    from fsspec.core import has_magic, url_to_fs

    fs, root = url_to_fs(source)
    if has_magic(root) and not fs.isfile(root):
        paths = [path for path in fs.glob(root) if fs.isfile(path) and not PurePosixPath(path).name.startswith(".")]
    elif fs.isdir(root):
        paths = [path for path in fs.find(root) if _is_recording(path, root)]
    elif fs.exists(root):
        paths = [root]
    else:
        raise FileNotFoundError("no such file or folder")
    _, chained, rest = source.partition(CHAIN)
    return [f"{fs.unstrip_protocol(path)}{chained}{rest}" for path in paths]


def _is_recording(path: str, root: str) -> bool:
    """Whether a file in a folder that was given is one; a file given by its name is, whatever it is called."""
    inside = PurePosixPath(path[len(root) :])
    hidden = any(part.startswith((".", "_", RESULTS)) for part in inside.parts)
    return is_named_as_recording(inside) and not hidden and inside.name not in (FAILURES, SURVEY)


def _placed(url: str, pattern: re.Pattern[str] | None) -> FleetRecording:
    said = dict(_FOLDER.findall(url))
    if pattern is not None and (match := pattern.search(url)):
        said |= {name: text for name, text in match.groupdict().items() if text}
    return FleetRecording(url, **said)


def _error_text(error: Exception) -> str:
    return str(error) or type(error).__name__


@contextmanager
def at_hand(url: str) -> Iterator[Path]:
    """Give the file of a recording, a copy of what is elsewhere, with the sidecar that belongs to it."""
    if REMOTE not in url:
        yield Path(url)
        return
    from fsspec.core import url_to_fs

    with tempfile.TemporaryDirectory(prefix="hil-fleet-") as folder:
        fs, remote = url_to_fs(url)
        path = Path(folder) / PurePosixPath(remote).name
        try:
            fs.get_file(remote, str(path))
            if fs.exists(remote_sidecar(remote)):
                fs.get_file(remote_sidecar(remote), str(sidecar_of(path)))
        except FileNotFoundError as error:
            raise RecordingError(url, "expected a readable file, got none of that name") from error
        yield path


def remote_sidecar(path: str) -> str:
    """Return where the description of a recording is that is elsewhere."""
    return str(sidecar_of(PurePosixPath(path)))  # type: ignore[arg-type]


@contextmanager
def side_by_side(found: Sequence[FleetRecording]) -> Iterator[list[Path]]:
    """Give the files of several recordings, each under a name of its own: many a folder has its own ``run_1.csv``."""
    with ExitStack() as stack:
        paths = [stack.enter_context(at_hand(each.url)) for each in found]
        if len({path.stem for path in paths}) == len(paths):
            yield paths
            return
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hil-fleet-")))
        named = []
        for each, path in zip(found, paths, strict=True):
            named.append(folder / f"{path.stem}-{each.sha256[:8]}{path.suffix}")
            named[-1].symlink_to(path.resolve())
            if sidecar_of(path).is_file():
                sidecar_of(named[-1]).symlink_to(sidecar_of(path).resolve())
        yield named


def seen(url: str) -> Seen:
    """Read the checksum of a recording, and what it says of itself."""
    with at_hand(url) as path:
        metadata = read_metadata(path)
        sums = [Source.of(each).sha256 for each in (path, sidecar_of(path)) if each == path or each.is_file()]
    sha256 = sums[0] if len(sums) == 1 else hashlib.sha256("".join(sums).encode()).hexdigest()
    return Seen(sha256, metadata.get("vehicle", ""), _rig_of(metadata), metadata.get("started_utc", ""))


def _rig_of(metadata: Mapping[str, str]) -> str:
    with suppress(tomllib.TOMLDecodeError):
        name: Any = tomllib.loads(metadata.get(RIG_TEXT, "")).get("name", "")
        return str(name)
    return ""
