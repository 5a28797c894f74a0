"""Drag of the air on the vehicle: it grows with the square of its speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Acting, Effect, EffectParameter, Element, Place, Retelling
from estimator.physics.effects import quadratic_friction
from estimator.physics.effects.quadratic_friction import AT, EXPONENT
from estimator.signals.record import Record


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the drag that was found with an exponent that is not 2."""
    return quadratic_friction.other_power("drag_nm_s2", quadratic_friction.scales(model, records)[0], values)


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    drag = unit("quadratic_drag", motion)
    return f"drag on the load that grows with the square of its speed: {values['drag_nm_s2']:.3g} {drag}"


EFFECT = Effect(
    name="aerodynamic_drag",
    element=Element.LOAD,
    title="aerodynamic drag",
    law="T_d = q w_L |w_L| |w_L/w_1|^(n-2), n = 2",
    source="Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992",
    excited_by="a wide range of speeds, high ones among them",
    parameters=(
        EffectParameter("drag_nm_s2", "quadratic_drag", 0.0, 0.0, 40.0, "torque per speed squared: q"),
        EXPONENT,
        AT,
    ),
    acting=Acting(Place.LOAD, quadratic_friction.law),
    structures=EVERY_LINE,
    resembles=("quadratic_friction", "road_grade"),
    scales=quadratic_friction.scales,
    starts=quadratic_friction.starts,
    testable=quadratic_friction.testable,
    retold=retold,
    sentence=sentence,
)
