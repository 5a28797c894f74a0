"""The speed is read through a low-pass filter."""

from __future__ import annotations

import math
from collections.abc import Mapping

from estimator.compiled import compiled
from estimator.physics import low_pass
from estimator.physics.driveline import Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, long_enough
from estimator.signals.record import OutputKind


@compiled
def step(
    before: float, after: float, filtered: float, rise: float, low: low_pass.LowPass, step_s: float
) -> tuple[float, float]:
    """Return the filtered value and its rate times ``tau`` behind an input straight from ``before`` to ``after``."""
    behind = (after - before) / step_s * low.time_constant  # as a ramp is followed
    value, rise = low_pass.faded(filtered - before + behind, rise - behind, low)
    return after - behind + value, rise + behind


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    time_ms = 1e3 * values["time_constant_s"]
    return f"the speed is read through a low-pass filter with a time constant of {time_ms:.3g} ms"


EFFECT = Effect(
    name="speed_filter",
    element=Element.SPEED_SENSOR,
    title="filter of the speed",
    law="s tau^2 d2y/dt2 + tau dy/dt + y = w_M",
    source="smoothing of a measured speed: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque steps: PRBS, tip-in and tip-out",
    parameters=(
        low_pass.TIME_CONSTANT,
        low_pass.SHAPE,
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
    scales=low_pass.scales,
    starts=low_pass.starts,
    sentence=sentence,
    implausible=low_pass.quick_enough("time_constant_s"),
    unresolved=long_enough("time_constant_s"),
    linear=True,
)
