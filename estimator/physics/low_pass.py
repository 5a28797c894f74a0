"""A low-pass filter, of torque or speed: how late it is, and its shape.

``s tau^2 d2y/dt2 + tau dy/dt + y = u``. Of what order a firmware's filter or a current loop is, nobody tells. But to
second order in the frequency w every low-pass is known by two numbers, a mean over some samples too: by how much it is
late, and what it takes from the amplitude, ``1 - (1/2 - s) (tau w)^2``: nothing with s = 1/2, as a delay does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from estimator.compiled import compiled
from estimator.physics.driveline import Driveline
from estimator.physics.effect import EffectParameter, Start
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
    form="second order",
)

SLOWEST_S = 0.1
"""Longest time constant [s] of a current loop or of a sensor's filter, or delay of a bus: a drive is of no use with
one. What a fit finds beyond it stands for something else that is slow."""

EQUAL_POLES = 1e-6
"""Half the distance of two poles, times the step, below which they are one."""


class LowPass(NamedTuple):
    """A low-pass over steps of one length: what is left, behind a step, of its output and of its rate times ``tau``.

    Attributes
    ----------
    time_constant, shape : float
        ``tau`` [s] and ``s``.
    turns : float
        Length of a step in ``tau``.
    output_of_output, output_of_rise, rise_of_output, rise_of_rise : float
        What is left of a unit of each in each, without an input.
    """

    time_constant: float
    shape: float
    turns: float
    output_of_output: float
    output_of_rise: float
    rise_of_output: float
    rise_of_rise: float


@compiled
def low_pass(time_constant: float, shape: float, step_s: float) -> LowPass:
    """Return a low-pass over steps of this length (exact); one without a time constant leaves nothing."""
    if time_constant <= 0.0:
        return LowPass(0.0, shape, math.inf, 0.0, 0.0, 0.0, 0.0)
    turns = step_s / time_constant
    if shape <= 0.0:  # of first order the output alone decides
        left = math.exp(-turns)
        return LowPass(time_constant, 0.0, turns, left, 0.0, -left, 0.0)
    root = math.sqrt(abs(1.0 - 4.0 * shape))
    middle, spread = -0.5 * turns / shape, 0.5 * turns / shape * root
    if shape < 0.25:
        slow, fast = math.exp(-2.0 * turns / (1.0 + root)), math.exp(middle - spread)
        even, odd = 0.5 * (slow + fast), 0.5 * (slow - fast)
    else:
        even, odd = math.exp(middle) * math.cos(spread), math.exp(middle) * math.sin(spread)
    odd = odd / spread if spread > EQUAL_POLES else math.exp(middle)
    return LowPass(
        time_constant, shape, turns, even - odd * middle, odd * turns, -odd * turns / shape, even + odd * middle
    )


@compiled
def faded(value: float, rise: float, low: LowPass) -> tuple[float, float]:
    """Return what is left of a filter's output, and of its rate times ``tau``, behind a step without an input."""
    left = low.output_of_output * value + low.output_of_rise * rise
    return left, low.rise_of_output * value + low.rise_of_rise * rise


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return one sampling period; the shape has no unit."""
    return (min(record.sample_time_s for record in records), 1.0)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a start below and one above a sampling period, with two equal poles."""
    return [(0.3, 0.25), (2.0, 0.25)]


def quick_enough(key: str) -> Callable[[Driveline, Sequence[Record], Mapping[str, float]], str]:
    """Return a check that a time is one of a torque path or a sensor."""

    def check(_model: Driveline, _records: Sequence[Record], values: Mapping[str, float]) -> str:
        if values[key] <= SLOWEST_S:
            return ""
        return f"{values[key]:.2g} s are longer than any current loop, filter or bus takes"

    return check
