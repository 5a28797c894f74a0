"""The torque in the air gap follows its reading with a lag."""

from __future__ import annotations

import math
from collections.abc import Mapping

from estimator.compiled import compiled
from estimator.physics import low_pass
from estimator.physics.driveline import Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, long_enough

FASTEST_S = 1e-9
"""Below this a lag is none; it keeps the exponential's argument finite."""


@compiled
def step(
    torque: float, rise: float, lagged: float, lag_rise: float, lag: low_pass.LowPass
) -> tuple[float, float, float, float]:
    """Return the lagged torque over a step of constant input as a straight line, and its value and rise at the end.

    The line has the mean and the first moment of the decay, exactly: mean and rise from end to end [Nm]. Without a lag
    the input's own rise is passed on; behind one it counts no more. The rise at the end is the rate times ``tau``.
    """
    if lag.time_constant < FASTEST_S:
        return torque, rise, torque, 0.0
    turns, shape, value = lag.turns, lag.shape, lagged - torque
    if shape <= 0.0:
        lag_rise = -value
    left, left_rise = low_pass.faded(value, lag_rise, lag)
    fallen = value - left + shape * (lag_rise - left_rise)
    mean = fallen / turns
    moment = (fallen - shape * (value - left) - turns * (left + shape * left_rise)) / (turns * turns)
    return torque + mean, 12.0 * (moment - 0.5 * mean), torque + left, left_rise


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the torque follows its reading with a lag of {1e3 * values['time_constant_s']:.3g} ms (time constant)"


EFFECT = Effect(
    name="actuator_lag",
    element=Element.TORQUE_PATH,
    title="lag of the torque",
    law="s tau^2 d2T/dt2 + tau dT/dt + T = T_read",
    source="model of a closed current loop: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque steps: PRBS, tip-in and tip-out",
    parameters=(
        low_pass.TIME_CONSTANT,
        low_pass.SHAPE,
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
    scales=low_pass.scales,
    starts=low_pass.starts,
    sentence=sentence,
    implausible=low_pass.quick_enough("time_constant_s"),
    unresolved=long_enough("time_constant_s"),
    linear=True,
)
