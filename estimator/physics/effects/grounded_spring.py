"""A spring between the load and the ground: a return spring, a bellows, a cable that is wound up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimator.compiled import compiled
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Acting, Effect, EffectParameter, Element, Place, Start
from estimator.physics.motion import range_of, torque_scale
from estimator.signals.record import Record


@compiled
def law(angle: float, stiffness: float) -> float:
    """Return ``k_g phi``; where the spring is slack is part of the constant load torque [Nm]."""
    return stiffness * angle


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return the torque in use over half the range of the motion."""
    return (torque_scale(records) / max(0.5 * range_of(records), np.finfo(float).tiny),)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return springs from soft to stiff, close to each other: the error is not convex in what swings on them."""
    return [(float(share),) for share in np.geomspace(0.03, 2.0, 9)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    size = f"{values['stiffness_nm_per_rad']:.3g} {unit('stiffness', motion)}"
    return f"a spring of {size} holds the load against the ground"


EFFECT = Effect(
    name="grounded_spring",
    element=Element.LOAD,
    title="spring to the ground",
    law="T_load = T_0 + k_g phi_L",
    source="Den Hartog, Mechanical Vibrations, 4th ed., 1956, ch. 2",
    excited_by="motion to and fro over a wide range, slow enough to feel it",
    parameters=(EffectParameter("stiffness_nm_per_rad", "stiffness", 0.0, 0.0, 100.0, "stiffness of the spring: k_g"),),
    example={"stiffness_nm_per_rad": 40.0},
    acting=Acting(Place.LOAD_ANGLE, law),
    structures=EVERY_LINE,
    resembles=("gravity", "road_grade"),
    scales=scales,
    starts=starts,
    sentence=sentence,
    linear=True,
    swinging=True,
)
