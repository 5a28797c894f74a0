"""The shaft's stiffness steps at a moment, as when it cracks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import MOMENTS, WITH_SPRING, Effect, EffectParameter, Element, Span, Start, Step
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return 1: the change is a share of the stiffness."""
    return (1.0,)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a softer and a stiffer shaft."""
    return [(-0.2,), (0.2,)]


def described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the stiffness before and after."""
    before, after = line["k"], line["k"] * (1.0 + values["change"])
    return {"k": ((before, before), (after, after))}


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the shaft's stiffness changes by {values['change']:+.1%} during the recording"


EFFECT = Effect(
    name="stiffness_change",
    element=Element.SHAFT,
    title="step of the shaft's stiffness",
    law="k becomes k (1 + delta) from t_1 to t_2 of a recording",
    source="breathing crack held open: Dimarogonas, Engineering Fracture Mechanics 55(5), 1996",
    excited_by="PRBS around the resonance before and after the change",
    parameters=(
        EffectParameter("change", "", 0.0, -0.95, 5.0, "relative change of the stiffness: delta"),
        *MOMENTS,
    ),
    structures=WITH_SPRING,
    resembles=("generator_coupled", "backlash", "stiffness_nonlinearity"),
    event=True,
    step=Step(lambda _model: "k", relative=True, lasting=True),
    scales=scales,
    starts=starts,
    sentence=sentence,
    described=described,
    linear=True,
    shows_start=frozenset({"twist"}),
)
