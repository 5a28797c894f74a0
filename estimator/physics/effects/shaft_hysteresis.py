"""Dry friction inside the shaft line: the torque lags the twist whatever the speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose
from estimator.physics.driveline import Driveline, Motion, Structure, unit
from estimator.physics.effect import WITH_SPRING, Effect, EffectParameter, Element, Held, Start
from estimator.physics.laws import power
from estimator.physics.motion import torque_scale
from estimator.signals.record import Record


@compiled
def loading_rate(loading: float, rate: float, sharpness: float, unloading: float, fastest: float) -> float:
    """Return how fast the slider loads [1/s]: towards 1 against the motion, and no further.

    ``rate`` is that of the twist, over the twist in which the slider yields [1/s]. One that yields within a step of the
    integration is held to the ``fastest`` decay [1/s] the step can follow.
    """
    pace = min(abs(rate), fastest)
    yielded = power(min(abs(loading), 1.0), sharpness)
    yielded = choose(rate * loading < 0.0, -unloading * yielded, yielded)
    return pace * math.copysign(1.0 - yielded, rate)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, a fiftieth of the twist that it gives, and 1 for the shape."""
    torque = torque_scale(records)
    return (0.05 * torque, 0.02 * torque / model.parameters["k"].value, 1.0, 1.0, 1.0)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return sliders that yield early and late, a part of them in the nominal stiffness.

    That of a joint is a guess and free.
    """
    early, late = (Held(0.0), Held(0.0)) if model.structure is Structure.JOINT else (0.2, 0.5)
    return [(0.5, 0.5, 1.0, 0.7, early), (1.0, 4.0, 1.0, 0.7, late)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    torque = unit("torque", motion)
    return (
        f"the shaft line has dry friction inside: {values['friction_nm']:.3g} {torque}, "
        f"yielding over {values['yield_rad']:.3g} {unit('angle', motion)}"
    )


EFFECT = Effect(
    name="shaft_hysteresis",
    element=Element.SHAFT,
    title="hysteresis of the shaft",
    law="T_S = (k - m T_h / y) twist + c r + T_h z, dz/dt = r (1 - |z|^n) / y, back r (1 + u |z|^n) / y, "
    "r = d twist/dt",
    source="Bouc-Wen: Wen, J. Eng. Mech. Div. ASCE 102, 1976; n = u = 1: Dahl, AIAA J. 14(12), 1976",
    excited_by="torque of both signs, small and large amplitudes",
    parameters=(
        EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque of the slider: T_h"),
        EffectParameter("yield_rad", "angle", 1.0, 0.1, 100.0, "twist over which it yields: y"),
        EffectParameter("sharpness", "", 1.0, 0.2, 20.0, "how suddenly it yields: n", True),
        EffectParameter("unloading", "", 1.0, 0.0, 1.0, "stiffness on the way back: u", True, most=1.0),
        EffectParameter("inside", "", 0.0, 0.0, 1.0, "part of its stiffness that k holds: m", True, most=1.0),
    ),
    structures=WITH_SPRING,
    resembles=("coulomb_friction_motor", "backlash", "stiffness_nonlinearity"),
    scales=scales,
    starts=starts,
    sentence=sentence,
)
