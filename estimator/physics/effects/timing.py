"""Effects that make torque or speed late: low-pass filters, a dead time, a clock that drifts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from estimator.compiled import compiled
from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, FitStart, long_enough
from estimator.physics.motion import longest_s
from estimator.signals.record import FloatArray, OutputKind, Record

# A low-pass filter, of torque or speed: how late it is, and its shape.
#
# ``s tau^2 d2y/dt2 + tau dy/dt + y = u``. Of what order a firmware's filter or a current loop is, nobody tells. But to
# second order in the frequency w every low-pass is known by two numbers, a mean over some samples too: by how much it
# is late, and what it takes from the amplitude, ``1 - (1/2 - s) (tau w)^2``: nothing with s = 1/2, as a delay does.


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

EQUAL_POLES = 1e-6  # half the distance of two poles, times the step, below which they are one

FASTEST_S = 1e-9  # below this a lag is none; it keeps the exponential's argument finite

PARTED_S = 0.03
"""How far apart the clocks of the scale are at the end [s]: half a period of a resonance at 16 Hz. A fit that begins
further off ends where another of its periods matches."""


class LowPass(NamedTuple):
    """A low-pass over steps of one length: what is left, behind a step, of its output and of its rate times ``tau``."""

    time_constant: float  # ``tau`` [s] and ``s``
    shape: float  # ``s``: 0 for first order
    turns: float  # length of a step in ``tau``
    output_of_output: float  # what is left of a unit of each in each, without an input
    output_of_rise: float  # ... of a unit of the rate in the output
    rise_of_output: float  # ... of the output in the rate
    rise_of_rise: float  # ... of the rate in the rate


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


def low_pass_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return one sampling period; the shape has no unit."""
    return (min(record.sample_time_s for record in records), 1.0)


def low_pass_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return a start below and one above a sampling period, with two equal poles."""
    return [(0.3, 0.25), (2.0, 0.25)]


def quick_enough(key: str) -> Callable[[Driveline, Sequence[Record], Mapping[str, float]], str]:
    """Return a check that a time is one of a torque path or a sensor."""

    def check(_model: Driveline, _records: Sequence[Record], values: Mapping[str, float]) -> str:
        if values[key] <= SLOWEST_S:
            return ""
        return f"{values[key]:.2g} s are longer than any current loop, filter or bus takes"

    return check


# The torque in the air gap follows its reading with a lag.


@compiled
def lag_step(
    torque: float, rise: float, lagged: float, lag_rise: float, lag: LowPass
) -> tuple[float, float, float, float]:
    """Return the lagged torque over a step of constant input as a straight line, and its value and rise at the end."""
    if lag.time_constant < FASTEST_S:
        return torque, rise, torque, 0.0
    turns, shape, value = lag.turns, lag.shape, lagged - torque
    if shape <= 0.0:
        lag_rise = -value
    left, left_rise = faded(value, lag_rise, lag)
    fallen = value - left + shape * (lag_rise - left_rise)
    mean = fallen / turns
    moment = (fallen - shape * (value - left) - turns * (left + shape * left_rise)) / (turns * turns)
    return torque + mean, 12.0 * (moment - 0.5 * mean), torque + left, left_rise


ACTUATOR_LAG = Effect(
    name="actuator_lag",
    element=Element.TORQUE_PATH,
    title="lag of the torque",
    law="s tau^2 d2T/dt2 + tau dT/dt + T = T_read",
    source="model of a closed current loop: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque steps: PRBS, tip-in and tip-out",
    parameters=(
        TIME_CONSTANT,
        SHAPE,
        EffectParameter(
            "before_nm",
            "torque",
            0.0,
            -math.inf,
            math.inf,
            "torque as a recording begins, less its reading",
            True,
            True,
        ),
    ),
    structures=EVERY_LINE,
    resembles=("transport_delay", "extra_torsional_mode", "speed_filter"),
    equivalent=("speed_filter",),
    scales=low_pass_scales,
    starts=low_pass_starts,
    text="the torque follows its reading with a lag of {time_constant_ms:.3g} ms (time constant)",
    implausible=quick_enough("time_constant_s"),
    unresolved=long_enough("time_constant_s"),
    linear=True,
)


# The torque acts later than its reading says: a dead time between reading and shaft.


@compiled
def delayed(torque: FloatArray, before: float, start: float, length: float) -> tuple[float, float]:
    """Return a zero-order-held torque over ``[start, start + length]``, at most a sample, as a straight line."""
    end = start + length
    last_row = torque.size - 1
    first = min(math.floor(start), last_row)
    last = min(math.floor(end), last_row)
    earlier = torque[first] if first >= 0 else before
    share = (end - last) / length
    if last == first or share <= 0.0:
        return float(earlier), 0.0
    jump = (torque[last] if last >= 0 else before) - earlier
    return float(earlier + jump * share), float(6.0 * jump * share * (1.0 - share))


TRANSPORT_DELAY = Effect(
    name="transport_delay",
    element=Element.TORQUE_PATH,
    title="delay of the torque",
    law="T(t) = T_read(t - t_d)",
    source="dead time of bus and inverter: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque steps: PRBS, tip-in and tip-out",
    parameters=(
        EffectParameter("delay_s", "s", 0.0, 0.0, 20.0, "dead time t_d"),
        EffectParameter(
            "before_nm", "torque", 0.0, -math.inf, math.inf, "torque before a recording, less its first", True, True
        ),
    ),
    structures=EVERY_LINE,
    resembles=("actuator_lag", "speed_filter", "stale_samples", "clock_drift"),
    scales=lambda _model, records: (min(record.sample_time_s for record in records),),
    starts=lambda _model, _records: [(0.4,), (1.5,), (4.0,)],
    text="the torque acts {delay_ms:.3g} ms later than its reading",
    implausible=quick_enough("delay_s"),
    unresolved=long_enough("delay_s"),
    linear=True,
)


# The speed is read through a low-pass filter.


@compiled
def filter_step(
    before: float, after: float, filtered: float, rise: float, low: LowPass, step_s: float
) -> tuple[float, float]:
    """Return the filtered value and its rate times ``tau`` behind an input straight from ``before`` to ``after``."""
    behind = (after - before) / step_s * low.time_constant  # as a ramp is followed
    value, rise = faded(filtered - before + behind, rise - behind, low)
    return after - behind + value, rise + behind


SPEED_FILTER = Effect(
    name="speed_filter",
    element=Element.SPEED_SENSOR,
    title="filter of the speed",
    law="s tau^2 d2y/dt2 + tau dy/dt + y = w_M",
    source="smoothing of a measured speed: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque steps: PRBS, tip-in and tip-out",
    parameters=(
        TIME_CONSTANT,
        SHAPE,
        EffectParameter(
            "before_rad_s",
            "speed",
            0.0,
            -math.inf,
            math.inf,
            "reading as a recording begins, less the speed",
            True,
            True,
        ),
    ),
    structures=EVERY_LINE,
    resembles=("actuator_lag", "transport_delay", "extra_torsional_mode"),
    equivalent=("actuator_lag",),
    kinds=frozenset({OutputKind.SPEED}),
    scales=low_pass_scales,
    starts=low_pass_starts,
    text="the speed is read through a low-pass filter with a time constant of {time_constant_ms:.3g} ms",
    implausible=quick_enough("time_constant_s"),
    unresolved=long_enough("time_constant_s"),
    linear=True,
)


# Torque and speed are stamped by clocks that run at different rates.


def drift_unresolved(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to clocks that part by less than a tenth of the sampling period over the longest recording."""
    least_s = 0.1 * min(record.sample_time_s for record in records)
    parted_s = abs(values["rate"]) * longest_s(records)
    if parted_s >= least_s:
        return ""
    return f"the clocks part by {1e3 * parted_s:.2g} ms, less than a tenth of the sampling period"


def drift_rescaled(values: Mapping[str, float]) -> Mapping[str, float]:
    """Return what the line takes by the torque's clock: the fit keeps to the speed's, and either may be right."""
    longer = 1.0 + values["rate"]
    return {"inertia": longer, "stiffness": 1.0 / longer}


def drift_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the rate in ppm."""
    return f"the torque's clock runs {1e6 * values['rate']:+.0f} ppm off the speed's"


CLOCK_DRIFT = Effect(
    name="clock_drift",
    element=Element.ACQUISITION,
    title="drift of the clocks",
    law="T(t) = T_read((1 + r) t)",
    source="free-running node clocks: CiA 301 (SYNC, TIME); Mills, Computer Network Time Synchronization, 2011",
    excited_by="long recordings with torque steps",
    parameters=(
        EffectParameter("rate", "", 0.0, -20.0, 20.0, "relative difference of the rates: r", least=-0.5, most=0.5),
    ),
    structures=EVERY_LINE,
    resembles=("transport_delay", "sample_jitter"),
    scales=lambda _model, records: (PARTED_S / longest_s(records),),
    starts=lambda _model, _records: [(side * parted,) for parted in (0.3, 1.0, 2.0, 3.0) for side in (-1.0, 1.0)],
    unresolved=drift_unresolved,
    text=drift_sentence,
    rescaled=drift_rescaled,
    linear=True,
    timed=True,
)
