"""Answers to a sealed set: each case by the public command, which sees that case alone; then seals opened, scored."""

from __future__ import annotations

import json
import tempfile
import time
import zlib
from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from drivers.foreign_file import read_regular, read_regular_text
from hil.errors import UsageError
from hil.files import parse_json
from hil.proof.command import CommandFailed, fresh_over_floor, replace_own, run_hil
from hil.proof.kinds import kind
from hil.proof.score import Answer, score
from hil.proof.seal import SealBroken, unlock, verify
from hil.proof.sealed_set import (
    CASES,
    SEALED,
    VERDICTS,
    VERDICTS_LIST,
    Shown,
    digest_of,
    digests_of,
    place_in,
    read_commitments,
    read_list,
    require_unchanged,
    write_list,
)
from hil.proof.work import WorkProgress, work_on

Row = dict[str, Any]

LIMIT_S = 900.0  # time one command may take before its case counts as failed

FAULT = "fault.txt"

LARGEST_TRUTH_BYTES = 1 << 28
"""What is unpacked of a sealed truth at most; with its fresh recordings one has a few million bytes."""


def answer(
    folder: Path, jobs: int, progress: WorkProgress, limit_s: float = LIMIT_S, pool: Executor | None = None
) -> str:
    """Answer every case of a set that has no answer yet; return one digest of all answers."""
    cases = read_commitments(folder)
    answered = work_on(
        list(cases),
        lambda name: _answer_one(folder, name, cases[name], limit_s),
        progress,
        jobs=jobs,
        pool=pool,
        known=_answered(folder, cases),
        keep=lambda done: write_list(folder / VERDICTS_LIST, done),
        said="answered",
    )
    return digest_of(answered)


def _answered(folder: Path, cases: Mapping[str, Shown]) -> dict[str, Any]:
    """Return the answers from an earlier run, to just these cases, that are still in their folders."""
    if not (folder / VERDICTS_LIST).exists():
        return {}
    listed = read_list(folder / VERDICTS_LIST, "remove the folder verdicts to begin anew")
    known = {name: digest_of(dict(shown.files)) for name, shown in cases.items()}
    return {
        name: entry
        for name, entry in listed.items()
        if entry.get("case") == known.get(name) and (folder / VERDICTS / name).is_dir()
    }


def _answer_one(folder: Path, name: str, shown: Shown, limit_s: float) -> dict[str, Any]:
    case, out = place_in(folder, CASES, name), place_in(folder, VERDICTS, name)
    require_unchanged(case, shown.files)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="hil-case-") as neutral:
        place, built = Path(neutral) / "case", Path(neutral) / "out"
        place.mkdir()
        built.mkdir()
        for file in shown.files:
            (place / file).write_bytes(read_regular(case / file))
        try:
            runs = sorted(file for file in shown.files if file.endswith(".csv"))
            run_hil(["diagnose", *runs, "--model", "model.toml", "--out", "../out"], place, limit_s)
        except CommandFailed as failure:
            (built / FAULT).write_text(f"{failure}\n", encoding="utf-8")
        took_s = time.perf_counter() - began
        files = digests_of(built, sorted(path.name for path in built.iterdir()))
        replace_own(out, built)
    return {"case": digest_of(dict(shown.files)), "files": files, "diagnose_s": round(took_s, 2)}


def judge_set(folder: Path, key: bytes, jobs: int, progress: WorkProgress, verdicts: str | None = None) -> list[Row]:
    """Open a set and score its verdicts."""
    cases = read_commitments(folder)
    answered = read_list(folder / VERDICTS_LIST, "hil prove run DIR writes it")
    if verdicts is not None and digest_of(answered) != verdicts:
        raise SealBroken(f"{folder / VERDICTS_LIST}: expected the verdicts of digest {verdicts}, got others")
    if missing := sorted(set(cases) - set(answered)):
        raise UsageError(
            f"{folder}: expected a verdict for every case, none for {', '.join(missing)}. hil prove run DIR"
        )
    for name, entry in answered.items():
        if not isinstance(entry.get("diagnose_s"), int | float):
            raise UsageError(f"{folder / VERDICTS_LIST}: {name}: expected diagnose_s, a number of seconds, got none")
    rows = work_on(
        sorted(cases),
        lambda name: _judge_one(folder, key, name, cases[name], answered[name]),
        progress,
        jobs=jobs,
        said="opened",
    )
    return list(rows.values())


def _judge_one(folder: Path, key: bytes, name: str, shown: Shown, answered: Mapping[str, Any]) -> Row:
    require_unchanged(place_in(folder, CASES, name), shown.files)
    if answered.get("case") != digest_of(dict(shown.files)):
        raise SealBroken(f"{folder / VERDICTS / name}: answers another case than {folder / CASES / name}")
    require_unchanged(place_in(folder, VERDICTS, name), answered["files"])
    sealed = place_in(folder, SEALED, f"{name}.sealed")
    truth = verify(shown.commitment, _unpacked(sealed, unlock(key, name, sealed)))
    case, fresh = truth["case"], truth["fresh"]
    if not isinstance(case, dict) or not isinstance(fresh, dict):
        raise SealBroken(f"{folder / SEALED / name}: expected a truth with case and fresh recordings")
    found = _answer(folder / VERDICTS / name, fresh, answered["diagnose_s"])
    return {"case": name, **score(kind(str(truth["kind"])), int(str(truth["seed"])), case, found)}


def _unpacked(path: Path, content: bytes) -> object:
    unpacking = zlib.decompressobj()
    try:
        text = unpacking.decompress(content, LARGEST_TRUTH_BYTES)
        if not unpacking.eof:
            raise ValueError(f"more than {LARGEST_TRUTH_BYTES} bytes, or a part of them")
        return parse_json(text.decode("utf-8"))
    except (ValueError, zlib.error) as error:
        raise SealBroken(f"{path}: expected a truth as hil prove make seals it, got {error}") from error


def _answer(verdict: Path, fresh: Mapping[str, str], took_s: float) -> Answer:
    if (verdict / FAULT).exists():
        return Answer(None, diagnose_s=took_s, fault=read_regular_text(verdict / FAULT).strip())
    diagnosis = json.loads(read_regular_text(verdict / "diagnosis.json"))
    try:
        over_floor = [fresh_over_floor(text, verdict / "augmented.toml", LIMIT_S) for text in fresh.values()]
    except CommandFailed as failure:
        return Answer(diagnosis, diagnose_s=took_s, fault=str(failure))
    return Answer(diagnosis, over_floor, took_s)
