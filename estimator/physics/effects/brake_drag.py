"""A brake that drags for a while."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.effect import EVERY_LINE, MOMENTS, Effect, EffectParameter, Element, Start
from estimator.physics.model import DrivelineModel, Motion, unit
from estimator.physics.motion import torque_scale
from estimator.signals.record import Record


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use."""
    return (0.05 * torque_scale(records),)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return one start: its moments are found by a scan."""
    return [(0.5,)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"a brake drags with {values['brake_nm']:.3g} {unit('torque', motion)} for a while"


EFFECT = Effect(
    name="brake_drag",
    element=Element.LOAD,
    title="dragging brake",
    law="T_b = T_B sign(w_L) from t_1 to t_2 of a recording",
    source="residual drag of friction brakes: Breuer, Bill, Brake Technology Handbook, SAE 2008",
    excited_by="driving, with stretches with and without",
    parameters=(
        EffectParameter("brake_nm", "torque", 0.0, 0.0, 60.0, "braking torque T_B"),
        *MOMENTS,
    ),
    structures=EVERY_LINE,
    resembles=("generator_coupled", "coulomb_friction_load", "road_grade"),
    equivalent=(),
    contains=(),
    event=True,
    permanent="coulomb_friction_load",
    scales=scales,
    starts=starts,
    sentence=sentence,
)
