"""The resolver's angle is off once and twice per turn, and with it the speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import some
from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start
from estimator.signals.record import OutputKind, Record

STEEPEST = -0.5
"""A resolver whose error falls by more than this per radian is no resolver; Newton's steps stay finite there."""


@compiled
def error(angle: float, once: float, once_phase: float, twice: float, twice_phase: float) -> float:
    """Return how far the read angle is off at a true one [rad]."""
    return once * math.sin(angle + once_phase) + twice * math.sin(2.0 * angle + twice_phase)


@compiled
def slope(angle: float, once: float, once_phase: float, twice: float, twice_phase: float) -> float:
    """Return the read angle's derivative by the true one: 1 for a resolver without error."""
    value = 1.0
    if some(once != 0.0):
        value += once * math.cos(angle + once_phase)
    if some(twice != 0.0):
        value += 2.0 * twice * math.cos(2.0 * angle + twice_phase)
    return value


@compiled
def true_angle(read: float, once: float, once_phase: float, twice: float, twice_phase: float) -> float:
    """Return the angle at which a resolver reads another [rad]; three of Newton's steps leave less than 1e-9."""
    angle = read
    for _ in range(3):
        off = angle + error(angle, once, once_phase, twice, twice_phase) - read
        rise = slope(angle, once, once_phase, twice, twice_phase) - 1.0
        angle -= off / (1.0 + max(rise, STEEPEST))
    return angle


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a hundredth of a radian, twice."""
    return (0.01, 0.01)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is linear in amplitudes and phases together."""
    return [(0.5, 0.5)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return (
        f"the resolver's angle is off by {1e3 * values['once_rad']:.3g} mrad once and "
        f"{1e3 * values['twice_rad']:.3g} mrad twice per turn"
    )


EFFECT = Effect(
    name="resolver_error",
    element=Element.SPEED_SENSOR,
    title="angle error of the resolver",
    law="w_read = w_M (1 + e_1 cos(phi_M + alpha_1) + 2 e_2 cos(2 phi_M + alpha_2))",
    source="Hanselman, IEEE Trans. Ind. Electron. 37(6), 1990: offset, amplitude and quadrature errors",
    excited_by="motion at any speed",
    parameters=(
        EffectParameter("once_rad", "rad", 0.0, 0.0, 40.0, "angle error once per turn: e_1", True),
        EffectParameter("twice_rad", "rad", 0.0, 0.0, 40.0, "angle error twice per turn: e_2", True),
        EffectParameter("once_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha_1, of each recording", True, True),
        EffectParameter("twice_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha_2, of each recording", True, True),
    ),
    structures=EVERY_LINE,
    resembles=("torque_ripple", "cardan_second_order", "speed_sign_blind"),
    kinds=frozenset({OutputKind.SPEED}),
    phases={"once_phase_rad": "once_rad", "twice_phase_rad": "twice_rad"},
    scales=scales,
    starts=starts,
    sentence=sentence,
    linear=True,
)
