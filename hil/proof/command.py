"""The public command line, run as any user would: in a process of its own, in a folder of its own.

What it has written replaces earlier results, and only such as this program has made itself, by a mark in them.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from hil.child import environment, python, run
from hil.errors import UsageError
from hil.proof.truth.recording import SPEED_NOISE_RAD_S

MARK: Final = ".made-by-hil"  # file that says that this program made a folder

MARK_TEXT: Final = "This folder was made by hil, which replaces it when it makes the results anew.\n"

SIMULATED: Final = "speed_sim_rad_s"  # column of ``hil simulate`` (CONTRACT)


class CommandFailed(Exception):
    """A command of the tool ended with another status than 0, or not in time."""


def run_hil(arguments: Sequence[str], folder: Path, limit_s: float) -> None:
    """Run ``hil`` with arguments in a folder; `CommandFailed` where it does not end with 0 within ``limit_s``."""
    done = run(python("-m", "hil", *arguments), folder, limit_s, environment())
    if done.status is None:
        raise CommandFailed(f"hil {arguments[0]}: took longer than {limit_s:g} s and was ended")
    if done.status != 0:
        (folder.parent / f"{arguments[0]}.stderr.txt").write_text(done.said, encoding="utf-8")
        said = done.said.strip().splitlines() or ["nothing on standard error"]
        raise CommandFailed(f"hil {arguments[0]}: ended with status {done.status}: {said[-1].strip()}")


def replace_own(folder: Path, built: Path) -> None:
    """Copy a folder to where it belongs, in place of the one that was made there before."""
    if folder.is_symlink() or folder.exists():
        if folder.is_symlink() or not (folder / MARK).is_file():
            raise UsageError(
                f"{folder}: expected no such folder, or one of earlier results ({MARK} in it), got something else. "
                "It is left as it is: move it away."
            )
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    (folder / MARK).write_text(MARK_TEXT, encoding="utf-8")  # first: half a copy is this program's too
    shutil.copytree(built, folder, dirs_exist_ok=True)


def fresh_over_floor(recording: str, model: Path, limit_s: float) -> float:
    """Return the free-run RMS error of a model file on a recording of the truth, over the noise of its speed reading.

    The public command simulates, in a place of its own; only samples that are good count.
    """
    with tempfile.TemporaryDirectory(prefix="hil-fresh-") as neutral:
        place = Path(neutral) / "fresh"
        place.mkdir()
        (place / "fresh.csv").write_text(recording, encoding="utf-8")
        shutil.copyfile(model, place / "model.toml")
        run_hil(["simulate", "--model", "model.toml", "--input", "fresh.csv", "--out", "simulated.csv"], place, limit_s)
        read, simulated_rad_s = _table(place / "fresh.csv"), _table(place / "simulated.csv")[SIMULATED]
    good = np.isfinite(read["speed_rad_s"])
    if "flags" in (read.dtype.names or ()):
        good &= read["flags"] == 0
    error = simulated_rad_s[good] - read["speed_rad_s"][good]
    return float(np.sqrt(np.mean(error**2)) / SPEED_NOISE_RAD_S)


def _table(path: Path) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    return np.genfromtxt(path, delimiter=",", names=True)
