"""The torque acts later than its reading says: a dead time between reading and shaft."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics import low_pass
from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, long_enough
from estimator.signals.record import FloatArray, Record


@compiled
def delayed(torque: FloatArray, before: float, start: float, length: float) -> tuple[float, float]:
    """Return a zero-order-held torque over ``[start, start + length]`` [samples], length at most 1, as a straight line.

    Its mean and its rise from end to end [Nm]: the line with the mean and the first moment of the jump. A mean alone
    would take from a torque at 10 Hz 1.6 % of its amplitude over a step of 10 ms, and an inertia would be that much
    off. Until the first sample the torque is ``before`` [Nm], after the last it is held at that one: the end of the
    last period may come out one rounding error late. Both are continuous in ``start``, which a fit needs.
    """
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


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return one sampling period."""
    return (min(record.sample_time_s for record in records),)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return starts within one period and at a few: the error is not convex in the delay."""
    return [(0.4,), (1.5,), (4.0,)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the torque acts {1e3 * values['delay_s']:.3g} ms later than its reading"


EFFECT = Effect(
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
    scales=scales,
    starts=starts,
    sentence=sentence,
    implausible=low_pass.quick_enough("delay_s"),
    unresolved=long_enough("delay_s"),
    linear=True,
)
