"""Which of several experiments on paper is driven."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from estimator.design.paper import Expected, Width
from hil.design.design import NEARLY, Aim, Design, Planned, _best as best, _Judged as Judged


def judged(seconds: float, right: float | None, odds: float = 1.0, **shows: float) -> Judged:
    """An experiment of so many seconds: the probability of the true explanation after it, by how much odds change."""
    gained = np.array([[0.0, math.log(odds)], [math.log(odds), 0.0]])
    decides = None if right is None else Expected(gained, right)
    return Judged(cast("Planned", SimpleNamespace(seconds=seconds)), decides, shows, math.nan)


CLEARER = {
    "more probable": (judged(30.0, 0.9, 10.0), judged(60.0, 0.95, 20.0)),
    "as probable, and clearer": (judged(30.0, 0.99, 100.0), judged(32.0, 1.0, 1e6)),
    "as probable and as clear, and shorter": (judged(60.0, 0.99, 100.0), judged(30.0, 0.99, 100.0)),
    "as probable, and shows more": (judged(30.0, 0.99, 1e6), judged(60.0, 0.99, 100.0, backlash=20.0)),
    "shows as much, and clearer": (judged(30.0, None, backlash=14.0), judged(32.0, None, backlash=500.0)),
    "shows more, less clearly": (judged(30.0, None, a=500.0), judged(32.0, None, a=500.0, b=14.0)),
}


@pytest.mark.parametrize(("worse", "better"), CLEARER.values(), ids=CLEARER)
def test_what_tells_most_is_driven(worse: Judged, better: Judged) -> None:
    assert best([worse, better]) is better
    assert best([better, worse]) is better


CURVE = (
    Width("table_motor_speed.value_1", 0.1, 1.5, 0.7, "Nm"),
    Width("table_motor_speed.value_2", 12.0, 0.5, 0.3, "Nm"),
)


@pytest.mark.parametrize(("now", "is_worth"), [(1.5, True), (0.9, False)])
def test_a_curve_is_measured_until_it_is_known_to_a_share_of_its_largest_value(now: float, is_worth: bool) -> None:
    """A tenth of 12 Nm; a value of 0.1 Nm need not be known to a tenth of itself."""
    first, second = CURVE
    widths = (replace(first, now=now), second)
    design = Design(Aim.LAW, "next_1", cast("Planned", None), None, widths, (), (), {})
    assert design.is_worth_driving is is_worth
    assert design.factor == pytest.approx(now / 0.7 if is_worth else math.sqrt(now / 0.7 * 0.5 / 0.3))


def test_clarity_is_no_reason_to_be_less_probable() -> None:
    assert best([few := judged(30.0, 0.9, 100.0), judged(30.0, 0.9 - 2.0 * NEARLY, 1e6)]) is few
