"""The payload steps: people get on or off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, load_inertia, unit
from estimator.physics.effect import EVERY_LINE, MOMENTS, Effect, EffectParameter, Element, Span, Start, Step
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a tenth of the load's inertia."""
    return (0.1 * model.parameters[load_inertia(model)].value,)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a lighter and a heavier load."""
    return [(-1.0,), (1.0,)]


def described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the load's inertia before and after."""
    name = load_inertia(model)
    before, after = line[name], line[name] + values["change_kg_m2"]
    return {name: ((before, before), (after, after))}


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the load's inertia changes by {values['change_kg_m2']:+.3g} {unit('inertia', motion)} during the recording"


EFFECT = Effect(
    name="inertia_change",
    element=Element.LOAD,
    title="step of the payload",
    law="J_L becomes J_L + delta from t_1 to t_2 of a recording",
    source="the vehicle's mass at the wheel, m r^2: Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992",
    excited_by="acceleration before and after the change",
    parameters=(
        EffectParameter("change_kg_m2", "inertia", 0.0, -7.0, 40.0, "change of the inertia: delta"),
        *MOMENTS,
    ),
    structures=EVERY_LINE,
    resembles=("generator_coupled", "road_grade"),
    event=True,
    step=Step(load_inertia),
    scales=scales,
    starts=starts,
    sentence=sentence,
    described=described,
    linear=True,
)
