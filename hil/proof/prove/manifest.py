"""What must not change: digests of files, and the two lists of them that a set of cases has.

``cases/commitments.json`` is written with the cases: a commitment to each truth, a digest of each file that is shown.
``verdicts/verdicts.json`` is written with the verdicts: a digest of each file of them, and of the case it answers.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.errors import UsageError
from hil.files import is_inside, is_plain, read_json
from hil.proof.seal import SealBroken, canonical_json

CASES, SEALED, VERDICTS = "cases", "sealed", "verdicts"
COMMITMENTS = Path(CASES) / "commitments.json"
VERDICTS_LIST = Path(VERDICTS) / "verdicts.json"
SCHEMA = "hil.prove/1"

_SHOWN = 80
"""Characters of a wrong name that a message shows."""

Digests = Mapping[str, str]
"""File name to SHA-256."""


def digests_of(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of files of a folder, by name."""
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}


def digest_of(listed: object) -> str:
    """Return one SHA-256 of a list; JSON types only."""
    return hashlib.sha256(canonical_json(listed)).hexdigest()


def require_unchanged(folder: Path, digests: Digests) -> None:
    """See that files are those a list was made of.

    Raises
    ------
    SealBroken
        Naming the first that is missing or has changed.
    UsageError
        If one is a link that leads out of the folder.
    """
    for name, digest in digests.items():
        path = place_in(folder, name)
        if not path.is_file():
            raise SealBroken(f"{path}: expected the file that is in the list, it is gone. Believe no score without it.")
        if digests_of(folder, [name])[name] != digest:
            raise SealBroken(f"{path}: changed since its digest was listed. Believe no score made from it.")


@dataclass(frozen=True, slots=True)
class Shown:
    """One case as it is shown: the commitment to its truth, and its files."""

    commitment: str
    files: Digests


def read_commitments(folder: Path) -> dict[str, Shown]:
    """Read the cases of a set by name.

    Raises
    ------
    UsageError
        If the folder has no set, or its list is damaged.
    """
    path, advice = folder / COMMITMENTS, "hil prove make DIR makes one"
    listed = read_list(path, advice)
    for name, entry in listed.items():
        if not isinstance(entry.get("commitment"), str):
            raise UsageError(f"{path}: {name}: expected a commitment, got none; {advice}")
    return {name: Shown(entry["commitment"], entry["files"]) for name, entry in listed.items()}


def read_list(path: Path, advice: str) -> dict[str, Any]:
    """Read the entries of a list by case.

    Raises
    ------
    UsageError
        If there is none, it is damaged, or a name in it is more than that; with advice.
    """
    try:
        listed = read_json(path)
    except OSError as error:
        raise UsageError(f"{path}: expected a list of cases, can't be read: {error.strerror}; {advice}") from error
    except ValueError as error:
        raise UsageError(f"{path}: expected JSON, got: {error}; {advice}") from error
    if not isinstance(listed, dict) or listed.get("schema") != SCHEMA or not isinstance(listed.get("cases"), dict):
        raise UsageError(f"{path}: expected an object of schema {SCHEMA} with cases; {advice}")
    cases: dict[str, Any] = listed["cases"]
    for name, entry in cases.items():
        if fault := _fault(name, entry):
            raise UsageError(f"{path}: {fault}; {advice}")
    return cases


def place_in(folder: Path, *names: str) -> Path:
    """Return the path of a file or folder of a set.

    Raises
    ------
    UsageError
        If it is a link, or behind one, that leads out of the folder.
    """
    path = folder.joinpath(*names)
    if not is_inside(folder, path):
        raise UsageError(f"{path}: expected a place inside {folder}, got a link that leads out of it. Remove it.")
    return path


def _fault(name: str, entry: object) -> str:
    """Say what is wrong with an entry of a list; names in it become paths. Empty where nothing is."""
    if not is_plain(name):
        return f"expected names of cases, plain ones such as case_001, got {name[:_SHOWN]!r}"
    files = entry.get("files") if isinstance(entry, dict) else None
    if not isinstance(files, dict) or not all(isinstance(digest, str) for digest in files.values()):
        return f"{name}: expected an object with files, each with its digest, got something else"
    wrong = next((file for file in files if not is_plain(file)), None)
    return "" if wrong is None else f"{name}: expected names of files, plain ones, got {wrong[:_SHOWN]!r}"


def write_list(path: Path, entries: Mapping[str, Any]) -> None:
    """Write a list of cases; a reader finds the old one or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.unfinished")
    unfinished.write_text(json.dumps({"schema": SCHEMA, "cases": entries}, indent=1) + "\n", encoding="utf-8")
    unfinished.replace(path)
