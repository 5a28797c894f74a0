"""The clutch to the generator is not open: its inertia turns with the motor for a while."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, MOMENTS, Effect, EffectParameter, Element, Start
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return half of the motor's inertia."""
    return (0.5 * model.parameters["J_M"].value,)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a small and a large generator."""
    return [(0.3,), (1.5,)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    inertia = unit("inertia", motion)
    return f"an extra inertia of {values['inertia_kg_m2']:.3g} {inertia} turns with the motor: clutch not open"


EFFECT = Effect(
    name="generator_coupled",
    element=Element.MOTOR,
    title="generator coupled",
    law="J_M becomes J_M + J_G from t_1 to t_2 of a recording",
    source="hybrid bus whose coupling to the generator opens: Nevaranta, Montonen, Lindh, EPE'18, 2018",
    excited_by="PRBS or torque steps while the clutch is closed",
    parameters=(
        EffectParameter("inertia_kg_m2", "inertia", 0.0, 0.0, 20.0, "inertia that is coupled: J_G"),
        *MOMENTS,
    ),
    structures=EVERY_LINE,
    resembles=("stiffness_change", "brake_drag", "inertia_change"),
    event=True,
    scales=scales,
    starts=starts,
    sentence=sentence,
    linear=True,
)
