"""One case of a campaign: made, diagnosed by the public command in a place of its own, and only then unsealed.

While the command runs, nothing of the truth is on disk: neither the effect's name, nor the seed, nor the fresh
recordings.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hil.proof.campaign.kinds import Kind
from hil.proof.make_case import write_recording, write_sealed, write_shown
from hil.proof.truth.case import Case, TruthRecording, make_case
from hil.proof.truth.sensors import SPEED_NOISE_RAD_S

SIMULATED = "speed_sim_rad_s"
"""Column of ``hil simulate`` (CONTRACT)."""


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


class CommandFailed(Exception):
    """A command of the tool ended with another status than 0, or not in time."""


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
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(neutral, folder)
    write_sealed(case, folder / "sealed")
    return json.loads(json.dumps(case.truth())), answer


def _ask(case: Case, place: Path, limit_s: float) -> Answer:
    shown = place / "case"
    write_shown(case, shown)
    runs = sorted(path.name for path in shown.glob("run_*.csv"))
    began = time.perf_counter()
    try:
        _hil(["diagnose", *runs, "--model", "model.toml", "--out", "../out"], shown, limit_s)
    except CommandFailed as failure:
        return Answer(None, diagnose_s=time.perf_counter() - began, fault=str(failure))
    diagnosed = time.perf_counter()
    diagnosis = json.loads((place / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    (place / "out" / "report.html").unlink(missing_ok=True)  # megabytes that the command can make again
    try:
        fresh = [_fresh_over_floor(r, place / "out", n, limit_s) for n, r in enumerate(case.fresh, start=1)]
        fault = None
    except CommandFailed as failure:
        fresh, fault = [], str(failure)
    return Answer(diagnosis, fresh, diagnosed - began, time.perf_counter() - diagnosed, fault)


def _fresh_over_floor(recording: TruthRecording, out: Path, number: int, limit_s: float) -> float:
    name, simulated = f"fresh_{number}.csv", f"fresh_{number}_simulated.csv"
    write_recording(out / name, recording)
    _hil(["simulate", "--model", "augmented.toml", "--input", name, "--out", simulated], out, limit_s)
    (out / name).unlink()
    table = np.genfromtxt(out / simulated, delimiter=",", names=True)
    return rms_over_floor(recording, table[SIMULATED])


def rms_over_floor(recording: TruthRecording, simulated_rad_s: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    """Return a simulation's RMS error over the noise of the speed reading, where the reading is good."""
    good = np.isfinite(recording.speed_rad_s)
    if recording.flags is not None:
        good &= recording.flags == 0
    error = simulated_rad_s[good] - recording.speed_rad_s[good]
    return float(np.sqrt(np.mean(error**2)) / SPEED_NOISE_RAD_S)


def _hil(arguments: Sequence[str], folder: Path, limit_s: float) -> None:
    """Run the public command in a folder.

    Raises
    ------
    CommandFailed
        With the last line it wrote, or that it took too long. All it wrote is beside the folder.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-m", "hil", *arguments],
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            timeout=limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise CommandFailed(f"hil {arguments[0]}: took longer than {limit_s:g} s and was ended") from None
    if done.returncode != 0:
        (folder.parent / f"{arguments[0]}.stderr.txt").write_text(done.stderr, encoding="utf-8")
        said = done.stderr.strip().splitlines() or ["nothing on standard error"]
        raise CommandFailed(f"hil {arguments[0]}: ended with status {done.returncode}: {said[-1].strip()}")
