"""``hil prove open`` scores the frequency band of every verdict from the sealed kind and seed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from hil.proof import fresh
from hil.proof.campaign.kinds import NOTHING
from hil.proof.prove import answer as answering
from hil.proof.prove.answer import answer
from hil.proof.prove.draw import draw
from hil.proof.prove.judge_set import judge_set
from hil.proof.prove.make import make
from hil.proof.prove.vault import new_key, parse_key

SEED = 5
"""Its first case hides something."""

KEY = parse_key(new_key())
REPORTED_HZ = [5.0, 12.0]


def silent(what: str, done: int, total: int) -> None:
    assert 0 < done <= total


def tells_a_band(arguments: Sequence[str], folder: Path, limit_s: float) -> None:
    """Stand for the command line: a mismatch in a band, and no name."""
    if arguments[0] == "diagnose":
        diagnosis = {
            "verdict": "unexplained",
            "mismatch": {"detected": True, "element": "shaft", "band_hz": REPORTED_HZ},
            "effects": [],
            "parameters": {},
            "fit": {"noise_floor": 0.05},
        }
        (folder.parent / "out" / "diagnosis.json").write_text(json.dumps(diagnosis))
        (folder.parent / "out" / "augmented.toml").write_text("a model")
        return
    read = np.genfromtxt(folder / "fresh.csv", delimiter=",", names=True)
    columns = np.column_stack([read["time_s"], read["speed_rad_s"]])
    np.savetxt(folder / "simulated.csv", columns, delimiter=",", header="time_s,speed_sim_rad_s", comments="")


def test_the_row_of_a_case_has_its_band(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, brief: None) -> None:
    for module in (answering, fresh):
        monkeypatch.setattr(module, "run_hil", tells_a_band)
    make(tmp_path / "set", 1, SEED, KEY, 1, silent)
    answer(tmp_path / "set", 1, silent)
    (row,) = judge_set(tmp_path / "set", KEY, 1, silent)
    (drawn,) = draw(1, SEED)
    assert drawn.kind.effect != NOTHING
    assert row["band"]["told_hz"] == REPORTED_HZ
    assert 0.0 <= row["band"]["power_share"] <= 1.0
    low, high = row["band"]["true_hz"]
    assert 0.0 <= low <= high <= 50.0
    assert isinstance(row["band"]["right"], bool)
