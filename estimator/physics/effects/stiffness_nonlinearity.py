"""A shaft that hardens or softens with twist."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import WITH_SPRING, Effect, EffectParameter, Element, Held, Retelling, Start
from estimator.physics.laws import beyond_gap, power
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


@compiled
def loaded_twist(twist: float, hardening: float, shape: float, stage: float, stage_from: float) -> float:
    """Return the twist at which a linear shaft carries the same torque [rad].

    From ``stage_from`` on, either way, a second spring is loaded next to the first: a coupling of two stages.
    """
    same = twist * factor(twist, hardening, shape)
    if every(stage == 0.0):
        return same
    return same + stage * beyond_gap(twist, 2.0 * stage_from)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return the hardening for a fifth more stiffness at the twist of the torque in use, 1 twice, and that twist."""
    twist = torque_scale(records) / model.parameters["k"].value
    return (0.2 / twist**2, 1.0, 1.0, twist)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a hardening and a softening start, without a second stage."""
    one = Held(0.0), Held(0.0)
    return [(0.5, 1.0, *one), (-0.5, 0.5, *one)]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return a shaft of two stages that hardens or softens as the one that was found, from small and larger twists."""
    if values["stage_share"] != 0.0:
        return []
    share = math.copysign(0.3, values["hardening_per_rad2"])
    return [Retelling((Held(0.0), Held(1.0), share, begins), {}) for begins in (0.2, 0.5)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found, as the twist at which the stiffness has changed by a tenth."""
    if stage := values.get("stage_share", 0.0):
        side, at = ("stiffer", values["stage_rad"]) if stage > 0 else ("softer", values["stage_rad"])
        return f"the shaft has two stages: {abs(stage):.0%} {side} beyond a twist of {at:.3g} {unit('angle', motion)}"
    hardening, shape = values["hardening_per_rad2"], values["shape"]
    kind, changed = ("hardens", 1.1) if hardening > 0 else ("softens", 1.0 / 0.9)
    twist = math.sqrt(shape * (math.pow(changed, 1.0 / shape) - 1.0) / abs(hardening))
    return f"the shaft {kind} with twist: by a tenth of its stiffness at {twist:.3g} {unit('angle', motion)}"


EFFECT = Effect(
    name="stiffness_nonlinearity",
    element=Element.SHAFT,
    title="hardening or softening shaft",
    law="T_S = k e (1 + |h| e^2 / m)^(m sign h) + c de/dt; of two stages T_S = k e + s k (e beyond +-e_2) + c de/dt",
    source="Duffing spring; for couplings: DIN 740-2 (progressive characteristic)",
    excited_by="large and small shaft torques in the same set of tests",
    parameters=(
        EffectParameter("hardening_per_rad2", "per_angle_squared", 0.0, -200.0, 200.0, "relative stiffness change h"),
        EffectParameter("shape", "", 1.0, 0.1, 3.0, "how the change continues at large twist: m", True),
        EffectParameter("stage_share", "", 0.0, -1.0, 10.0, "stiffness that a second stage adds, over k: s", True),
        EffectParameter("stage_rad", "angle", 0.0, 0.02, 1.0, "twist from which on it is loaded: e_2", True),
    ),
    structures=WITH_SPRING,
    resembles=("torque_saturation", "backlash", "stiffness_change", "shaft_hysteresis", "extra_torsional_mode"),
    scales=scales,
    starts=starts,
    sentence=sentence,
    retold=retold,
    loosens=frozenset({"k", "c"}),  # of an oscillation whose frequency goes with its size a linear line damps the beats
    shows_start=frozenset({"twist"}),
)
