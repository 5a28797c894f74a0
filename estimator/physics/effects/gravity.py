"""Gravity on a load that is not balanced: an arm, a pendulum, a door."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimator.compiled import compiled
from estimator.lanes import every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Acting, Effect, EffectParameter, Element, Held, Place, Start
from estimator.physics.motion import range_of, torque_scale
from estimator.signals.record import Record

SWINGS_RAD = (1.0, 2.0, 4.0, 8.0)
"""Ranges of the load's angle from which a fit starts where the gear ratio is not known."""


@compiled
def law(angle: float, moment: float, turns: float, phase: float) -> float:
    """Return ``G sin(phi_M / i + alpha)`` [Nm], against the load."""
    if every(moment == 0.0):
        return 0.0
    return moment * math.sin(angle / turns + phase)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a fifth of the torque in use, and the gear ratio, or that with which the load swings by a radian."""
    return (0.2 * torque_scale(records), model.gear_ratio or max(range_of(records), 1.0))


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start for each gear ratio that may be; the problem is linear in moment and phase together."""
    if model.gear_ratio is not None:
        return [(1.0, Held(1.0))]
    return [(1.0, 1.0 / swing) for swing in SWINGS_RAD]


def implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Refuse what changes, over the load's swing, by more than the torque does from end to end, however it hangs."""
    swing = min(range_of(records) / values["motor_turns_per_turn"], 2.0 * math.pi)
    most = max(float(np.abs(record.total_torque_nm).max()) for record in records)
    if values["moment_nm"] * (1.0 - math.cos(0.5 * swing)) <= 2.0 * most:
        return ""
    return f"{values['moment_nm']:.3g} Nm over {swing:.2g} rad is more than all torque that was applied"


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    turns = values["motor_turns_per_turn"]
    geared = f", {turns:.3g} motor turns to one turn of the load" if turns != 1.0 else ""
    return f"gravity pulls at the load with up to {values['moment_nm']:.3g} {unit('torque', motion)}{geared}"


EFFECT = Effect(
    name="gravity",
    element=Element.LOAD,
    title="gravity on an unbalanced load",
    law="T_load = T_0 + G sin(phi_M / i + alpha)",
    source="Siciliano, Sciavicco, Villani, Oriolo, Robotics, Springer 2009, ch. 7",
    excited_by="slow motion over a wide range of angles",
    parameters=(
        EffectParameter("moment_nm", "torque", 0.0, 0.0, 50.0, "largest moment of gravity: G"),
        EffectParameter("motor_turns_per_turn", "", 1.0, 0.05, 10.0, "motor turns per turn of the load: i", True),
        EffectParameter("phase_rad", "rad", 0.0, -10.0, 10.0, "angle at the start from hanging: alpha", True, True),
    ),
    example={"moment_nm": 60.0, "motor_turns_per_turn": 3.0},
    acting=Acting(Place.RECORDED_ANGLE, law),
    structures=EVERY_LINE,
    resembles=("load_imbalance", "road_grade", "torque_ripple"),
    contains=("grounded_spring",),  # over a small part of a turn
    phases={"phase_rad": "moment_nm"},
    scales=scales,
    starts=starts,
    implausible=implausible,
    sentence=sentence,
    waving=True,
    swinging=True,
)
