"""Real recordings with part of their physics concealed: what the public command says of them, and what is known.

Recordings are written where nothing else is, without the channels that would tell what is concealed. Only when
``hil diagnose`` has answered is ``truth.toml`` read.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from drivers.foreign_file import read_regular, read_regular_text
from hil.errors import UsageError
from hil.proof.command import CommandFailed, replace_own, run_hil
from hil.proof.real_files import (
    CASE,
    MODEL,
    ROOM,
    CaseFile,
    KnownValue,
    RunEntry,
    case_folders,
    read_case,
    read_truth,
    require_recording,
    write_shown,
)
from hil.proof.work import WorkProgress, read_entries, silent, work_on, write_entries

SCHEMA = "hil.real/2"
FILE_NAME = "real.json"

LIMIT_S = 3600.0  # time one command may take before its run counts as failed

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Agreement:
    """One known value besides what was found."""

    what: str  # as the truth file names it
    unit: str  # of all its values
    truth: float  # the known value
    found: float | None  # None where the verdict does not have it
    ci95: tuple[float, float] | None  # 95 % interval; None without one
    inside: bool | None  # whether the 95 % interval holds the known value
    within: bool  # whether it agrees as closely as the truth file asks
    asked: str  # in words, how closely


def run_real(
    data: Path,
    out: Path,
    names: Sequence[str] = (),
    jobs: int = 1,
    progress: WorkProgress = silent,
    room: Path = ROOM,
    pool: Executor | None = None,
) -> list[Json]:
    """Run real recordings through the public command and judge what it says."""
    folders = case_folders(list(names), room)
    cases = {name: read_case(folder) for name, folder in folders.items()}
    for name, case in cases.items():
        read_truth(folders[name])  # a fault in it would show after hours otherwise
        for entry in case.recordings.values():
            require_recording(data, entry)
    runs = {f"{name}/{run.name}": (name, run) for name, case in cases.items() for run in case.runs}

    others = [entry for entry in read_real(out) if entry["name"] not in cases]

    def judged(answers: Mapping[str, Json]) -> list[Json]:
        entries = [_case(name, folders[name], case, answers, out) for name, case in cases.items()]
        write_entries(out / FILE_NAME, SCHEMA, "cases", [*entries, *others])
        return entries

    answers = work_on(
        list(runs),
        lambda place: _ask(folders[runs[place][0]], cases[runs[place][0]], runs[place][1], data, out / place),
        progress,
        jobs=jobs,
        pool=pool,
        known=_known(out, folders),
        keep=judged,
        said="diagnosed",
    )
    return judged(answers)


def read_real(out: Path) -> list[Json]:
    """Return the entries that an earlier run has left; none where there was none."""
    path = out / FILE_NAME
    if not path.exists():
        return []
    cases = read_entries(path, SCHEMA, "cases", "remove it")
    if not isinstance(cases, list) or not all(
        isinstance(case, dict) and {"name", "runs"} <= set(case) for case in cases
    ):
        raise UsageError(f"{path}: expected cases, a list of objects with name and runs; remove it")
    return cases


def _known(out: Path, folders: Mapping[str, Path]) -> dict[str, Json]:
    """Return the answers to the same questions that are still there."""
    found = {}
    for case in read_real(out):
        for run in case["runs"]:
            place = f"{case['name']}/{run['name']}"
            asked = case["name"] in folders and run["key"] == _key(folders[case["name"]])
            if asked and run["fault"] is None and (out / place / "diagnosis.json").is_file():
                found[place] = {name: run[name] for name in ("key", "fault", "duration_s")}
    return found


def _key(folder: Path) -> str:
    """Return what changes with the question; the recordings are in it by their checksums."""
    return hashlib.sha256(b"".join(read_regular(folder / name) for name in (CASE, MODEL))).hexdigest()


def _ask(folder: Path, case: CaseFile, run: RunEntry, data: Path, out: Path) -> Json:
    """Have one run diagnosed in a place that holds nothing else."""
    began, fault = time.perf_counter(), None
    with tempfile.TemporaryDirectory(prefix="hil-recording-") as neutral:
        place, answered = Path(neutral) / "case", Path(neutral) / "out"
        place.mkdir()
        answered.mkdir()
        (place / MODEL).write_bytes(read_regular(folder / MODEL))
        fit = [write_shown(case, name, data, place).name for name in run.fit]
        held_out = [write_shown(case, name, data, place).name for name in run.held_out]
        arguments = ["diagnose", *fit, "--model", MODEL, "--out", "../out"]
        try:
            run_hil([*arguments, *(["--holdout", *held_out] if held_out else [])], place, LIMIT_S)
        except CommandFailed as failure:
            fault = str(failure)
        replace_own(out, answered)
    return {"key": _key(folder), "fault": fault, "duration_s": round(time.perf_counter() - began, 1)}


def _case(name: str, folder: Path, case: CaseFile, answers: Mapping[str, Json], out: Path) -> Json:
    runs = []
    for run in case.runs:
        place = f"{name}/{run.name}"
        if place in answers:
            runs.append({"name": run.name, **answers[place], **_judged(folder, case, out, place, answers[place])})
    return {
        "name": name,
        "title": case.title,
        "concealed": case.concealed,
        "conceals": case.conceals,
        "runs": runs,
        "named_right": len(runs) == len(case.runs) and all(run["right"] for run in runs),
    }


def _judged(folder: Path, case: CaseFile, out: Path, place: str, answer: Json) -> Json:
    if answer["fault"] is not None:
        empty: Json = {"verdict": None, "named": [], "statement": "", "unit": "", "agreements": [], "report": None}
        return {**empty, "held_out": {"before": None, "after": None}, "right": False}
    diagnosis = json.loads(read_regular_text(out / place / "diagnosis.json"))
    named = [effect["name"] for effect in diagnosis["effects"]]
    fit = diagnosis["fit"]
    return {
        "verdict": diagnosis["verdict"],
        "named": named,
        "statement": diagnosis["statement"],
        "unit": fit["unit"],
        "held_out": {"before": fit["holdout_retuned"], "after": fit["holdout_augmented"]},
        "agreements": [asdict(agreement(known, diagnosis)) for known in read_truth(folder).values],
        "report": f"{place}/report.html",
        "right": set(named) == set(case.concealed),
    }


def agreement(known: KnownValue, diagnosis: Mapping[str, Any]) -> Agreement:
    """Compare one known quantity with a diagnosis."""
    entry = _entry(diagnosis, known.found) or {"value": None, "ci95": (None, None)}
    found, (low, high) = entry["value"], entry["ci95"]
    within = found is not None and abs(found - known.value) <= known.within * abs(known.value)
    ci95 = None if found is None or low is None or high is None else (low, high)
    inside = None if ci95 is None else ci95[0] <= known.value <= ci95[1]
    asked = f"within {known.within:.0%} of {known.value:g} {known.unit}"
    return Agreement(known.what, known.unit, known.value, found, ci95, inside, within, asked)


def _entry(diagnosis: Mapping[str, Any], place: str) -> Mapping[str, Any] | None:
    """Return the value and interval at a dotted place of ``diagnosis.json``."""
    match place.split("."):
        case ["parameters", name]:
            return _table(diagnosis["parameters"].get(name))
        case ["effects", effect, name]:
            found = [entry for entry in diagnosis["effects"] if entry["name"] == effect]
            return _table(found[0]["parameters"].get(name)) if found else None
        case ["load_torque"]:
            loads = list(diagnosis["load_torque"].values())
            return _table(loads[0]) if len(loads) == 1 else None
    raise ValueError(f"expected parameters.NAME, effects.NAME.NAME or load_torque, got {place}")


def _table(value: Any) -> Mapping[str, Any] | None:
    return value if isinstance(value, dict) else None
