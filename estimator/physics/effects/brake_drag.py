"""A brake that drags for a while."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, MOMENTS, Effect, EffectParameter, Element, Held, Retelling, Start
from estimator.physics.effects import coulomb_friction_load
from estimator.physics.effects.coulomb_friction_load import CREEP, PRESLIDING
from estimator.physics.motion import reverses
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return those of dry friction at the load."""
    return coulomb_friction_load.scales(model, records)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start: its moments are found by a scan. Presliding and creep wait for them."""
    return [(0.5, Held(0.0), Held(0.0))]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the brake that was found, bending before it slides, sticking or creeping, where a recording shows that."""
    if not any(reverses(record) for record in records):
        return []
    return coulomb_friction_load.bending("brake_nm", model, records, values)


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"a brake drags with {values['brake_nm']:.3g} {unit('torque', motion)} during a part of the recording"


EFFECT = Effect(
    name="brake_drag",
    element=Element.LOAD,
    title="dragging brake",
    law="T_b = T_B sign(w_L) from t_1 to t_2 of a recording; with presliding "
    "dT_b/dt = (T_B / x_b) (w_L - |w_L| T_b / T_B); creeping T_b = T_B tanh(w_L / w_c)",
    source="residual drag of friction brakes: Breuer, Bill, Brake Technology Handbook, SAE 2008; presliding: Dahl, "
    "AIAA J. 14(12), 1976",
    excited_by="driving, with stretches with and without",
    parameters=(
        EffectParameter("brake_nm", "torque", 0.0, 0.0, 60.0, "braking torque T_B"),
        PRESLIDING,
        CREEP,
        *MOMENTS,
    ),
    structures=EVERY_LINE,
    resembles=("generator_coupled", "coulomb_friction_load", "road_grade"),
    event=True,
    permanent="coulomb_friction_load",
    scales=scales,
    starts=starts,
    retold=retold,
    sentence=sentence,
    linear=True,
)
