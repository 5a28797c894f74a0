"""A report for a supporter: one ZIP with versions, rig file, logs and the last run, and without secrets."""

from __future__ import annotations

import io
import json
import os
import platform
import re
import sys
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from drivers.foreign_file import read_regular_text
from hil.errors import InputError, UsageError
from hil.support.command_log import VARIABLE, log_file
from hil.support.redact import Redaction
from hil.version import DISTRIBUTION, __version__

ABOUT = """What is in this report, for whoever is asked to send it: read it before you do.

versions.json   versions of hil, Python and its libraries; the kind of machine
rig/            the rig file without its comments, as it is but for what is named below
log/            what hil was asked to do, and how it ended
last_run.json   what the last recording says of itself: experiment, settings, timing; none of its samples

Taken out and marked: keys, passwords, tokens and certificates; users and passwords in addresses; the folders of
paths; the names of the user and of this machine. Comments of the rig file, operator's notes and recordings are not in
it. Names of files and rigs are, and so are addresses of devices.
"""


@dataclass(frozen=True, slots=True)
class Part:
    """One file of the report."""

    name: str  # path in the ZIP, with /
    content: bytes  # redacted


@dataclass(frozen=True, slots=True)
class BugReport:
    """The report, and what was taken out of it."""

    parts: tuple[Part, ...]  # its files
    taken_out: Mapping[str, int]  # how often each kind of private thing was taken out
    missing: tuple[str, ...]  # what could not be put in, and why

    def zipped(self) -> bytes:
        """Return it as one ZIP."""
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for part in self.parts:
                archive.writestr(part.name, part.content)
        return buffer.getvalue()


def bug_report(rigs: tuple[Path, ...], runs: Path) -> BugReport:
    """Gather a report."""
    redaction, missing = Redaction(), []
    parts = [Part("about.txt", ABOUT.encode()), _json("versions.json", redaction.document(versions()))]
    parts += [_rig(path, redaction) for path in rigs]
    logs = [Part(f"log/{path.name}", _redacted(path, redaction)) for path in _logs()]
    if not logs:
        missing.append(f"logs: none in {log_file().parent}")
    if not rigs:
        missing.append("rig file: none was named; give it by --rig")
    try:
        run = _last_run(runs)
        run["rig_text"] = redaction.toml(run["rig_text"])
        parts.append(_json("last_run.json", redaction.document(run)))
    except InputError as error:  # a damaged store is what a report may be about
        missing.append(f"last run: {error}")
    return BugReport((*parts, *logs), redaction.counts, tuple(missing))


def _rig(path: Path, redaction: Redaction) -> Part:
    try:
        text = read_regular_text(path, errors="replace")
        return Part(f"rig/{path.name}", redaction.toml(text).encode())
    except OSError as error:
        raise UsageError(f"--rig {path}: expected a readable file, got: {error.strerror}") from error


def _redacted(path: Path, redaction: Redaction) -> bytes:
    return redaction.text(read_regular_text(path, errors="replace")).encode()


def _logs() -> Iterator[Path]:
    newest = log_file()
    if newest.parent.is_dir():
        yield from sorted(newest.parent.glob(f"{newest.name}*"))


def _last_run(folder: Path) -> dict[str, Any]:
    """Return what the store says of the newest run, without what people wrote about it."""
    from hil.store import STORE_NAME, RunStore

    if not (folder / STORE_NAME).is_dir():
        raise UsageError(f"{folder}: expected a run store ({STORE_NAME}), got none; name its folder by --runs")
    with RunStore(folder) as store:
        found = store.find()
    if not found:
        raise UsageError(f"{folder / STORE_NAME}: expected a run, got none")
    last = found[-1]
    entry = {key: str(value) if isinstance(value, Path) else value for key, value in asdict(last.entry).items()}
    return {"run": last.run_id, "verdict": last.verdict, **entry}


def _json(name: str, document: Any) -> Part:
    return Part(name, (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode())


def versions() -> dict[str, Any]:
    """Return versions and the kind of machine; nothing of the user."""
    return {
        "hil": __version__,
        "python": sys.version,
        "platform": platform.platform(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
        "packages": _packages(),
        "environment": {name: os.environ[name] for name in (VARIABLE, "LANG", "TERM") if name in os.environ},
    }


def _packages() -> dict[str, str]:
    """Return the version of each library this program asks for, as it is installed."""
    try:
        required = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return {DISTRIBUTION: "not installed as a package"}
    names = sorted({re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in required})
    return {name: _version(name) for name in names}


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing"
