"""The torque in the air gap follows its reading with a first-order lag."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, long_enough
from estimator.physics.model import DrivelineModel, Motion
from estimator.signals.record import Record

FASTEST_S = 1e-9
"""Below this a lag is none; it keeps the exponential's argument finite."""


@compiled
def step(torque: float, rise: float, lagged: float, time_constant: float, step_s: float) -> tuple[float, float, float]:
    """Return the lagged torque over a step of constant input as a straight line, and its value at the end (exact).

    The line has the mean and the first moment of the decay: mean and rise from end to end [Nm]. Without a lag the
    input's own rise is passed on; behind one it counts no more.
    """
    if time_constant < FASTEST_S:
        return torque, rise, torque
    turns = step_s / time_constant
    decay = math.exp(-turns)
    difference = lagged - torque
    mean = (1.0 - decay) / turns
    moment = (1.0 - decay * (1.0 + turns)) / (turns * turns)
    return torque + difference * mean, 12.0 * difference * (moment - 0.5 * mean), torque + difference * decay


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return one sampling period."""
    return (min(record.sample_time_s for record in records),)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return a start below and one above a sampling period."""
    return [(0.3,), (2.0,)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the torque follows its reading with a lag of {1e3 * values['time_constant_s']:.3g} ms"


EFFECT = Effect(
    name="actuator_lag",
    element=Element.TORQUE_PATH,
    title="lag of the torque",
    law="tau dT/dt + T = T_read",
    source="first-order model of a closed current loop: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque steps: PRBS, tip-in and tip-out",
    parameters=(
        EffectParameter("time_constant_s", "s", 0.0, 0.0, 50.0, "time constant tau"),
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
    contains=(),
    scales=scales,
    starts=starts,
    sentence=sentence,
    unresolved=long_enough("time_constant_s"),
)
