"""A shaft that hardens or softens with twist."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.abreast import choose, every
from estimator.compiled import compiled
from estimator.physics.effect import WITH_SPRING, Effect, EffectParameter, Element, Start
from estimator.physics.laws import power
from estimator.physics.model import DrivelineModel, Motion, unit
from estimator.physics.motion import torque_scale
from estimator.signals.record import Record


@compiled
def factor(twist: float, hardening: float, shape: float) -> float:
    """Return the factor on the stiffness, ``(1 + |h| e^2 / m)^(+-m)`` with the sign of h.

    To first order it is ``1 + h e^2`` whatever the shape m. A hardening shaft with m = 1 is the Duffing spring; a
    softening one with m = 1/2 ends in a constant torque, and none ever pulls the wrong way.
    """
    if every(hardening == 0.0):
        return 1.0
    size = 1.0 + abs(hardening) * twist * twist / shape
    return power(size, choose(hardening > 0.0, shape, -shape))


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return the hardening that changes the stiffness by a fifth at the twist of the torque in use, and 1."""
    twist = torque_scale(records) / model.parameters["k"].value
    return (0.2 / twist**2, 1.0)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return a hardening and a softening start."""
    return [(0.5, 1.0), (-0.5, 0.5)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found, as the twist at which the stiffness has changed by a tenth."""
    hardening, shape = values["hardening_per_rad2"], values["shape"]
    kind, changed = ("hardens", 1.1) if hardening > 0 else ("softens", 1.0 / 0.9)
    twist = math.sqrt(shape * (math.pow(changed, 1.0 / shape) - 1.0) / abs(hardening))
    return f"the shaft {kind} with twist: by a tenth of its stiffness at {twist:.3g} {unit('angle', motion)}"


EFFECT = Effect(
    name="stiffness_nonlinearity",
    element=Element.SHAFT,
    title="hardening or softening shaft",
    law="T_S = k e (1 + |h| e^2 / m)^(m sign h) + c de/dt",
    source="Duffing spring; for couplings: DIN 740-2 (progressive characteristic)",
    excited_by="large and small shaft torques in the same set of tests",
    parameters=(
        EffectParameter("hardening_per_rad2", "per_angle_squared", 0.0, -200.0, 200.0, "relative stiffness change h"),
        EffectParameter("shape", "", 1.0, 0.1, 3.0, "how the change goes on at large twist: m", True),
    ),
    structures=WITH_SPRING,
    resembles=("torque_saturation", "backlash", "stiffness_change", "shaft_hysteresis", "extra_torsional_mode"),
    equivalent=(),
    contains=(),
    scales=scales,
    starts=starts,
    sentence=sentence,
    loosens=frozenset({"k", "c"}),  # of an oscillation whose frequency goes with its size a linear line damps the beats
)
