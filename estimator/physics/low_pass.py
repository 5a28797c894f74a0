"""A low-pass filter, of torque or speed: how late it is, and its shape.

``s tau^2 d2y/dt2 + tau dy/dt + y = u``. Of what order a firmware's filter or a current loop is, nobody tells. But to
second order in the frequency w every low-pass is known by two numbers, a mean over some samples too: by how much it is
late, and what it takes from the amplitude, ``1 - (1/2 - s) (tau w)^2``: nothing with s = 1/2, as a delay does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from estimator.compiled import compiled
from estimator.physics.effect import EffectParameter, Start
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record

TIME_CONSTANT = EffectParameter("time_constant_s", "s", 0.0, 0.0, 50.0, "time constant tau: by how much a ramp is late")
SHAPE = EffectParameter(
    "shape",
    "",
    0.0,
    0.0,
    0.5,
    "s: 0 of first order, 1/4 two equal poles, 1/2 Butterworth's, which is nearly a delay",
    True,
)

EQUAL_POLES = 1e-6
"""Half the distance of two poles, times the step, below which they are one."""


@compiled
def faded(value: float, rise: float, turns: float, shape: float) -> tuple[float, float]:
    """Return what is left of a filter's output, and of its rate times ``tau``, after ``turns`` of ``tau`` (exact).

    There is no input. Of first order (no shape) the output alone decides.
    """
    if shape <= 0.0:
        value *= math.exp(-turns)
        return value, -value
    root = math.sqrt(abs(1.0 - 4.0 * shape))
    middle, spread = -0.5 * turns / shape, 0.5 * turns / shape * root
    if shape < 0.25:
        slow, fast = math.exp(-2.0 * turns / (1.0 + root)), math.exp(middle - spread)
        even, odd = 0.5 * (slow + fast), 0.5 * (slow - fast)
    else:
        even, odd = math.exp(middle) * math.cos(spread), math.exp(middle) * math.sin(spread)
    odd = odd / spread if spread > EQUAL_POLES else math.exp(middle)
    left = even * value + odd * (turns * rise - middle * value)
    return left, even * rise + odd * (middle * rise - turns * value / shape)


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return one sampling period; the shape has no unit."""
    return (min(record.sample_time_s for record in records), 1.0)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return a start below and one above a sampling period, with two equal poles."""
    return [(0.3, 0.25), (2.0, 0.25)]
