"""The recordings of a fleet: files, folders, globs and Parquet datasets, here or behind a URL of fsspec.

A recording belongs to a vehicle and a rig: as the pattern of the path says; else a Parquet dataset's folders
(``vehicle=7/rig=a``); else the recording's own metadata (``vehicle``, the name in its rig file); else its folder.
"""

from __future__ import annotations

import hashlib
import re
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from hil.errors import RecordingError, UsageError
from hil.fleet.dataset import FAILURES, RESULTS
from hil.provenance import Source
from hil.recording.checksum import RIG_TEXT
from hil.recording.description import sidecar_of
from hil.recording.formats import FORMATS, read_metadata

REMOTE = "://"

GROUPS = ("vehicle", "rig", "started")
"""What a pattern may take from a path; all but the last are named by a Parquet dataset's folders as well."""

_FOLDER = re.compile(r"(?:^|/)(vehicle|rig)=([^/]+)(?=/)")


@dataclass(frozen=True, slots=True)
class Found:
    """A recording of the fleet, by its path or its address of fsspec; the rest is empty where nothing says it."""

    url: str
    vehicle: str = ""
    rig: str = ""
    started: str = ""  # ISO 8601
    sha256: str = ""  # of its content, and of the sidecar that belongs to it

    @property
    def name(self) -> str:
        """The name of the file."""
        return PurePosixPath(self.url).name


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


def find(sources: Sequence[str], pattern: re.Pattern[str] | None) -> tuple[list[Found], list[str]]:
    """Return the recordings that sources name, in their order, and what is wrong with the other sources."""
    found: dict[str, Found] = {}
    complaints: list[str] = []
    for source in sources:
        try:
            urls = _urls(source)
        except Exception as error:  # noqa: BLE001 - each file system of fsspec has errors of its own
            complaints.append(f"{source}: expected files that can be listed, got: {_said(error)}")
            continue
        if not urls:
            complaints.append(f"{source}: expected recordings, got none")
        found.update((url, _placed(url, pattern)) for url in urls)
    return list(found.values()), complaints


def _urls(source: str) -> list[str]:
    """Return the files of one source, sorted."""
    from fsspec.core import has_magic, url_to_fs

    fs, root = url_to_fs(source)
    if has_magic(root):
        paths = [path for path in fs.glob(root) if fs.isfile(path) and not PurePosixPath(path).name.startswith(".")]
    elif fs.isdir(root):
        paths = [path for path in fs.find(root) if _is_recording(path, root)]
    elif fs.exists(root):
        paths = [root]
    else:
        raise FileNotFoundError("no such file or folder")
    return sorted(fs.unstrip_protocol(path) if REMOTE in source else str(path) for path in paths)


def _is_recording(path: str, root: str) -> bool:
    """Whether a file in a folder that was given is one; a file given by its name is, whatever it is called."""
    inside = PurePosixPath(path[len(root) :])
    hidden = any(part.startswith((".", "_", RESULTS)) for part in inside.parts)
    return inside.suffix.lower() in FORMATS and not hidden and inside.name != FAILURES


def _placed(url: str, pattern: re.Pattern[str] | None) -> Found:
    said = dict(_FOLDER.findall(url))
    if pattern is not None and (match := pattern.search(url)):
        said |= {name: text for name, text in match.groupdict().items() if text}
    return Found(url, **said)


def _said(error: Exception) -> str:
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
            if fs.exists(str(sidecar_of(PurePosixPath(remote)))):  # type: ignore[arg-type]
                fs.get_file(str(sidecar_of(PurePosixPath(remote))), str(sidecar_of(path)))  # type: ignore[arg-type]
        except FileNotFoundError as error:
            raise RecordingError(url, "expected a readable file, got none of that name") from error
        yield path


@contextmanager
def side_by_side(found: Sequence[Found]) -> Iterator[list[Path]]:
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


def described(found: Found) -> Found:
    """Return a recording with its checksum, and with what it says of itself where the path has not said it."""
    with at_hand(found.url) as path:
        sums = [Source.of(each).sha256 for each in (path, sidecar_of(path)) if each == path or each.is_file()]
        metadata = read_metadata(path)
    sha256 = sums[0] if len(sums) == 1 else hashlib.sha256("".join(sums).encode()).hexdigest()
    rig = found.rig or _rig_of(metadata)
    vehicle = found.vehicle or metadata.get("vehicle", "") or rig or PurePosixPath(found.url).parent.name
    started = found.started or metadata.get("started_utc", "")
    return replace(found, vehicle=vehicle, rig=rig, started=started, sha256=sha256)


def _rig_of(metadata: Mapping[str, str]) -> str:
    with suppress(tomllib.TOMLDecodeError):
        name: Any = tomllib.loads(metadata.get(RIG_TEXT, "")).get("name", "")
        return str(name)
    return ""
