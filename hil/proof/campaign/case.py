"""One case of a campaign: made, diagnosed by the public command in a place of its own, and only then unsealed.

While the command runs, nothing of the truth is on disk: neither the effect's name, nor the seed, nor the fresh
recordings.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.proof.campaign.kinds import Kind
from hil.proof.command import CommandFailed, run_hil
from hil.proof.fresh import fresh_over_floor
from hil.proof.make_case import write_recording, write_sealed, write_shown
from hil.proof.own_folder import replace_own
from hil.proof.truth.case import Case, TruthRecording, make_case


@dataclass(frozen=True, slots=True)
class Answer:
    """What the command made of a case.

    Attributes
    ----------
    diagnosis : mapping or None
        Content of ``diagnosis.json``; None where there is none.
    fresh_over_floor : sequence of float
        Free-run RMS error of the augmented model on each fresh recording, over the noise of the speed reading.
    diagnose_s, simulate_s : float
        Time taken [s], start of the process included; the latter for all fresh recordings.
    fault : str or None
        Why a command did not do its job.
    """

    diagnosis: Mapping[str, Any] | None
    fresh_over_floor: Sequence[float] = field(default_factory=tuple)
    diagnose_s: float = 0.0
    simulate_s: float = 0.0
    fault: str | None = None


def run_case(kind: Kind, seed: int, folder: Path, limit_s: float) -> tuple[dict[str, Any], Answer]:
    """Make, diagnose and unseal one case.

    Parameters
    ----------
    kind, seed
        What to hide, and what everything is drawn from.
    folder
        Gets ``case/``, ``out/`` and ``sealed/`` when all is over; an older one is replaced.
    limit_s
        Time for one command [s]; one that takes longer is ended and counts as failed.

    Returns
    -------
    dict
        The truth, JSON types only.
    Answer
    """
    return run_made(make_case(kind.effect, seed, kind.nominal_error), folder, limit_s)


def run_made(case: Case, folder: Path, limit_s: float) -> tuple[dict[str, Any], Answer]:
    """Diagnose and unseal a case that is made already; see `run_case`."""
    with tempfile.TemporaryDirectory(prefix="hil-case-") as neutral:
        answer = _ask(case, Path(neutral), limit_s)
        replace_own(folder, Path(neutral))
    write_sealed(case, folder / "sealed")
    return json.loads(json.dumps(case.truth())), answer


def _ask(case: Case, place: Path, limit_s: float) -> Answer:
    shown = place / "case"
    write_shown(case, shown)
    runs = sorted(path.name for path in shown.glob("run_*.csv"))
    began = time.perf_counter()
    try:
        run_hil(["diagnose", *runs, "--model", "model.toml", "--out", "../out"], shown, limit_s)
    except CommandFailed as failure:
        return Answer(None, diagnose_s=time.perf_counter() - began, fault=str(failure))
    diagnosed = time.perf_counter()
    diagnosis = json.loads((place / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    (place / "out" / "report.html").unlink(missing_ok=True)  # megabytes that the command can make again
    try:
        fresh = [_judged(recording, place / "out", limit_s) for recording in case.fresh]
        fault = None
    except CommandFailed as failure:
        fresh, fault = [], str(failure)
    return Answer(diagnosis, fresh, diagnosed - began, time.perf_counter() - diagnosed, fault)


def _judged(recording: TruthRecording, out: Path, limit_s: float) -> float:
    with tempfile.TemporaryDirectory(prefix="hil-fresh-") as unseen:
        path = Path(unseen) / "fresh.csv"
        write_recording(path, recording)
        return fresh_over_floor(path, out / "augmented.toml", limit_s)
