"""Steps over the edge of a gap: where its faces meet, in smaller ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.driveline import Start
from estimator.physics.grid import Grid, grid_for
from estimator.physics.kernel.rates import met
from estimator.physics.layout import flat
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

GAP, CONTACT = 0.02, 0.001
PERIOD_S = 0.01

CROSSED = {
    "touches": (0.009, 0.0101, True),
    "parts": (-0.0101, -0.009, True),
    "crosses the gap": (0.0101, -0.0101, True),
    "turns within the gap": (0.003, -0.003, False),
    "stays in the gap": (0.003, 0.0099, False),
    "continues into its play": (0.0101, 0.0109, True),
    "rests in its play": (0.0101, 0.0102, False),
    "is wound up": (0.02, 0.022, False),
}


@pytest.mark.parametrize("name", CROSSED)
def test_faces_meet(name: str) -> None:
    begun, ended, there = CROSSED[name]
    assert met(begun, ended, GAP, CONTACT) == there
    assert met(ended, begun, GAP, CONTACT) == there
    assert met(-begun, -ended, GAP, CONTACT) == there


def test_hard_faces_have_no_play() -> None:
    assert met(0.0099, 0.0101, GAP, 0.0)
    assert not met(0.0101, 0.02, GAP, 0.0)


def reversing(line: DrivelineModel, finer: int) -> FloatArray:
    """Return the free run of a line whose shaft unwinds through its gap and back, again and again."""
    rec = replace(record(random_steps(400, seed=3), np.ones(400)), time_s=PERIOD_S * np.arange(400))
    coarse = grid_for(line, [rec])
    grid = Grid(line.structure, finer * coarse.substeps, coarse.sign_width)
    return simulate(grid, rec, flat(line), Start(0.0, 0.0, 0.0, 0.015, 0.0))


def error_of_steps(line: DrivelineModel) -> float:
    """Return by how much the steps of a line are off, over the RMS of its free run about its mean."""
    exact = reversing(line, 64)
    return float(np.std(reversing(line, 1) - exact) / np.std(exact))


@pytest.mark.parametrize("contact_rad", [0.0, 0.0005, 0.002])
def test_a_gap_takes_little_of_their_order_from_the_steps(contact_rad: float) -> None:
    """In steps of one size the error is 3e-3 to 4e-3 of the free run, in the smaller ones a seventh of that at most."""
    gap = {"gap_rad": 0.01, "contact_rad": contact_rad, "pull": 0.3}
    assert error_of_steps(model(TWO_MASS, effects={"backlash": gap})) < 1e-3
