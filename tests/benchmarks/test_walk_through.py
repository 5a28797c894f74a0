"""The documented walk-through, once, on the real protocol stacks."""

from pathlib import Path

import pytest

from estimator.identification.best import Verdict
from tests.benchmarks.walk_through import linear_truth, walk


@pytest.mark.campaign
def test_a_gap_leaves_the_damping_near_that_of_the_line_and_is_said(tmp_path: Path) -> None:
    best = walk(3, tmp_path / "cruise.csv")
    assert best.verdict is Verdict.NOT_LINEAR
    assert best.linearity.depends_on == "the torque in the shaft"
    assert best.mode is not None
    assert best.mode.damping.value == pytest.approx(linear_truth()[1], rel=0.15)
