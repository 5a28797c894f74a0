"""The speed is read through a low-pass filter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, long_enough
from estimator.physics.model import DrivelineModel, Motion
from estimator.signals.record import OutputKind, Record


@compiled
def step(before: float, after: float, filtered: float, time_constant: float, step_s: float) -> float:
    """Return the filtered value after a step of input that goes straight from ``before`` to ``after`` (exact)."""
    slope = (after - before) / step_s
    decay = math.exp(-step_s / time_constant)
    return after - slope * time_constant + (filtered - before + slope * time_constant) * decay


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return one sampling period."""
    return (min(record.sample_time_s for record in records),)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return a start below and one above a sampling period."""
    return [(0.3,), (2.0,)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the speed is read through a low-pass filter of {1e3 * values['time_constant_s']:.3g} ms"


EFFECT = Effect(
    name="speed_filter",
    element=Element.SPEED_SENSOR,
    title="filter of the speed",
    law="tau dy/dt + y = w_M",
    source="smoothing of a measured speed: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque steps: PRBS, tip-in and tip-out",
    parameters=(
        EffectParameter("time_constant_s", "s", 0.0, 0.0, 50.0, "time constant tau"),
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
    contains=(),
    kinds=frozenset({OutputKind.SPEED}),
    scales=scales,
    starts=starts,
    sentence=sentence,
    unresolved=long_enough("time_constant_s"),
)
