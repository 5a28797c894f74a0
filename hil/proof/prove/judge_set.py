"""``hil prove open``: seals opened, commitments checked, verdicts scored."""

from __future__ import annotations

import json
import tempfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil.errors import UsageError
from hil.files import parse_json
from hil.proof.campaign.band import score_band
from hil.proof.campaign.case import Answer
from hil.proof.campaign.kinds import kind
from hil.proof.campaign.score import score
from hil.proof.command import CommandFailed
from hil.proof.fresh import fresh_over_floor
from hil.proof.prove.answer import FAULT, LIMIT_S
from hil.proof.prove.each import each
from hil.proof.prove.make import Progress
from hil.proof.prove.manifest import (
    CASES,
    SEALED,
    VERDICTS,
    VERDICTS_LIST,
    Shown,
    digest_of,
    place_in,
    read_commitments,
    read_list,
    require_unchanged,
)
from hil.proof.prove.vault import unlock
from hil.proof.seal import SealBroken, verify

Row = dict[str, Any]

LARGEST_TRUTH_BYTES = 1 << 28
"""What is unpacked of a sealed truth at most; with its fresh recordings one has a few million bytes."""


def judge_set(folder: Path, key: bytes, jobs: int, progress: Progress, verdicts: str | None = None) -> list[Row]:
    """Open a set and score its verdicts.

    Parameters
    ----------
    verdicts
        The digest that ``answer`` returned, where it was kept: verdicts and their list can't both be changed then.

    Returns
    -------
    list of dict
        One row per case, as a campaign's (``hil.proof.campaign.score``), with ``case``, its name, next to.

    Raises
    ------
    SealBroken
        If a truth, a case or a verdict is not what it was; naming it.
    UsageError
        If a case has no verdict yet.
    """
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
    rows: dict[str, Row] = {}
    for name, row in each(lambda name: _judge_one(folder, key, name, cases[name], answered[name]), list(cases), jobs):
        rows[name] = row
        progress(f"{name} opened", len(rows), len(cases))
    return [rows[name] for name in sorted(rows)]


def _judge_one(folder: Path, key: bytes, name: str, shown: Shown, answered: Mapping[str, Any]) -> Row:
    require_unchanged(place_in(folder, CASES, name), shown.files)
    if answered.get("case") != digest_of(dict(shown.files)):
        raise SealBroken(f"{folder / VERDICTS / name}: answers another case than {folder / CASES / name}")
    require_unchanged(place_in(folder, VERDICTS, name), answered["files"])
    sealed = place_in(folder, SEALED, f"{name}.sealed")
    opened = _unpacked(sealed, unlock(key, name, sealed))
    truth = verify(shown.commitment, opened)
    planted, case, fresh = kind(str(truth["kind"])), truth["case"], truth["fresh"]
    if not isinstance(case, dict) or not isinstance(fresh, dict):
        raise SealBroken(f"{folder / SEALED / name}: expected a truth with case and fresh recordings")
    answer = _answer(folder / VERDICTS / name, fresh, answered["diagnose_s"])
    seed = int(str(truth["seed"]))
    band = score_band(planted, seed, case, answer.diagnosis)
    return {"case": name, **score(planted, seed, case, answer), "band": band}


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
        return Answer(None, diagnose_s=took_s, fault=(verdict / FAULT).read_text(encoding="utf-8").strip())
    diagnosis = json.loads((verdict / "diagnosis.json").read_text(encoding="utf-8"))
    try:
        over_floor = [_over_floor(text, verdict / "augmented.toml") for text in fresh.values()]
    except CommandFailed as failure:
        return Answer(diagnosis, diagnose_s=took_s, fault=str(failure))
    return Answer(diagnosis, over_floor, took_s)


def _over_floor(recording: str, model: Path) -> float:
    with tempfile.TemporaryDirectory(prefix="hil-fresh-") as unsealed:
        path = Path(unsealed) / "fresh.csv"
        path.write_text(recording, encoding="utf-8")
        return fresh_over_floor(path, model, LIMIT_S)
