"""How a model does on a recording that nobody has fitted."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.proof.command import run_hil
from hil.proof.truth.recording import SPEED_NOISE_RAD_S

SIMULATED = "speed_sim_rad_s"
"""Column of ``hil simulate`` (CONTRACT)."""

FloatArray = NDArray[np.float64]


def fresh_over_floor(recording: Path, model: Path, limit_s: float) -> float:
    """Return the free-run RMS error of a model file on a recording of the truth, over the noise of its speed reading.

    The public command simulates, in a place of its own.

    Raises
    ------
    CommandFailed
        If it does not, within ``limit_s`` [s].
    """
    with tempfile.TemporaryDirectory(prefix="hil-fresh-") as neutral:
        place = Path(neutral) / "fresh"
        place.mkdir()
        shutil.copyfile(recording, place / "fresh.csv")
        shutil.copyfile(model, place / "model.toml")
        run_hil(["simulate", "--model", "model.toml", "--input", "fresh.csv", "--out", "simulated.csv"], place, limit_s)
        simulated = _table(place / "simulated.csv")[SIMULATED]
    read = _table(recording)
    flags = read["flags"] if "flags" in (read.dtype.names or ()) else np.zeros(read.size)
    return rms_over_floor(read["speed_rad_s"], flags, simulated)


def rms_over_floor(speed_rad_s: FloatArray, flags: FloatArray, simulated_rad_s: FloatArray) -> float:
    """Return a simulation's RMS error over the noise of the speed reading, where that is good; all of shape (N,)."""
    good = np.isfinite(speed_rad_s) & (flags == 0)
    error = simulated_rad_s[good] - speed_rad_s[good]
    return float(np.sqrt(np.mean(error**2)) / SPEED_NOISE_RAD_S)


def _table(path: Path) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    return np.genfromtxt(path, delimiter=",", names=True)
