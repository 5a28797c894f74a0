"""A sealed set of cases: made and sealed, and what of it must not change.

::

    DIR/cases/commitments.json    a commitment to each truth, a digest of each file that is shown
    DIR/cases/case_001/           model.toml, run_1.csv ...: what the tool gets
    DIR/sealed/case_001.sealed    the truth and fresh recordings, encrypted
    DIR/verdicts/case_001/        diagnosis.json, augmented.toml, report.html; or fault.txt: why there is none
    DIR/verdicts/verdicts.json    a digest of each file, and of the case it answers
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.foreign_file import read_regular
from hil.errors import UsageError
from hil.files import is_inside, is_plain
from hil.proof.kinds import Drawn, draw
from hil.proof.make_case import write_recording, write_shown
from hil.proof.seal import SealBroken, canonical_json, lock, seal
from hil.proof.truth.case import Case, make_case
from hil.proof.work import WorkProgress, read_entries, work_on, write_entries
from hil.result_folder import LOCK

CASES, SEALED, VERDICTS = "cases", "sealed", "verdicts"
COMMITMENTS = Path(CASES) / "commitments.json"
VERDICTS_LIST = Path(VERDICTS) / "verdicts.json"
SCHEMA = "hil.prove/1"

_SHOWN = 80  # characters of a wrong name that a message shows
Digests = Mapping[str, str]  # file name to SHA-256


def make(folder: Path, cases: int, seed: int, key: bytes, jobs: int, progress: WorkProgress) -> None:
    """Make and seal a set of cases; the folder appears when all of it is there."""
    if folder.exists() and (not folder.is_dir() or any(path.name != LOCK for path in folder.iterdir())):
        raise UsageError(f"{folder}: expected a folder that is not there yet or is empty. Choose another.")
    folder.parent.mkdir(parents=True, exist_ok=True)
    drawn = {case.name: case for case in draw(cases, seed)}
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".unfinished-") as workshop:
        built = Path(workshop) / "set"
        (built / SEALED).mkdir(parents=True)
        listed = work_on(list(drawn), lambda name: _make_one(built, drawn[name], key), progress, jobs=jobs, said="made")
        write_list(built / COMMITMENTS, listed)
        folder.mkdir(exist_ok=True)
        for name in (SEALED, CASES):  # what lists them is in the last
            (built / name).replace(folder / name)


def _make_one(folder: Path, drawn: Drawn, key: bytes) -> dict[str, object]:
    case = make_case(drawn.kind.effect, drawn.seed, drawn.kind.nominal_error)
    shown = folder / CASES / drawn.name
    write_shown(case, shown)
    truth = {"kind": drawn.kind.name, "seed": drawn.seed, "case": case.truth(), "fresh": _fresh(case)}
    sealed = seal(json.loads(json.dumps(truth)))
    content = zlib.compress(json.dumps(sealed.opened()).encode())
    (folder / SEALED / f"{drawn.name}.sealed").write_bytes(lock(key, drawn.name, content))
    return {
        "commitment": sealed.commitment,
        "files": digests_of(shown, sorted(path.name for path in shown.iterdir())),
    }


def _fresh(case: Case) -> Mapping[str, str]:
    """Return the fresh recordings as text, by file name."""
    with tempfile.TemporaryDirectory(prefix="hil-fresh-") as place:
        for number, recording in enumerate(case.fresh, start=1):
            write_recording(Path(place) / f"fresh_{number}.csv", recording)
        return {path.name: path.read_text(encoding="utf-8") for path in sorted(Path(place).iterdir())}


def digests_of(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of files of a folder, by name."""
    return {name: hashlib.sha256(read_regular(folder / name)).hexdigest() for name in names}


def digest_of(listed: object) -> str:
    """Return one SHA-256 of a list; JSON types only."""
    return hashlib.sha256(canonical_json(listed)).hexdigest()


def require_unchanged(folder: Path, digests: Digests) -> None:
    """See that files are those a list was made of."""
    for name, digest in digests.items():
        path = place_in(folder, name)
        if not path.is_file():
            raise SealBroken(f"{path}: expected the file that is in the list, it is gone. Believe no score without it.")
        if digests_of(folder, [name])[name] != digest:
            raise SealBroken(f"{path}: changed since its digest was listed. Believe no score made from it.")


@dataclass(frozen=True, slots=True)
class Shown:
    """One case as it is shown: the commitment to its truth, and its files."""

    commitment: str  # 64 hexadecimal digits
    files: Digests  # SHA-256 by name


def read_commitments(folder: Path) -> dict[str, Shown]:
    """Read the list of a set's shown cases, by name; `UsageError` where it is none."""
    path, advice = folder / COMMITMENTS, "hil prove make DIR makes one"
    listed = read_list(path, advice)
    for name, entry in listed.items():
        if not isinstance(entry.get("commitment"), str):
            raise UsageError(f"{path}: {name}: expected a commitment, got none; {advice}")
    return {name: Shown(entry["commitment"], entry["files"]) for name, entry in listed.items()}


def read_list(path: Path, advice: str) -> dict[str, Any]:
    """Read the entries of a list by case."""
    cases = read_entries(path, SCHEMA, "cases", advice)
    if not isinstance(cases, dict):
        raise UsageError(f"{path}: expected an object of schema {SCHEMA} with cases; {advice}")
    for name, entry in cases.items():
        if fault := _fault(name, entry):
            raise UsageError(f"{path}: {fault}; {advice}")
    return cases


def write_list(path: Path, entries: Mapping[str, Any]) -> None:
    """Write a list of cases, by name."""
    write_entries(path, SCHEMA, "cases", dict(sorted(entries.items())))


def place_in(folder: Path, *names: str) -> Path:
    """Return the path of a file or folder of a set."""
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
