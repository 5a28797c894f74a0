"""Torque is lost in the gears in proportion to what they transmit, and not the same in both directions of power."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import WITH_SHAFT, Acting, Effect, EffectParameter, Element, Place, Start, Untestable
from estimator.physics.motion import torque_reverses, turns
from estimator.signals.record import Record


@compiled
def law(torque: float, sign: float, driving: float, back: float) -> float:
    """Return the torque that is lost [Nm], against the motion, whose sign is rounded at standstill."""
    if every(driving == 0.0) and every(back == 0.0):
        return 0.0
    return sign * abs(torque) * choose(torque * sign > 0.0, driving, back)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return five per cent each."""
    return (0.05, 0.05)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return the same loss both ways: the problem is close to linear in both."""
    return [(0.5, 0.5)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need both signs of torque and of speed, or else it is a gain of the torque or a constant load."""
    if turns(model, records) and any(torque_reverses(record) for record in records):
        return None
    return Untestable("torque or speed never change sign: not separable from gain and constant load", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return (
        f"the gears lose torque in proportion to what they transmit: {values['driving_share']:.2%} driving, "
        f"{values['back_share']:.2%} when the load drives"
    )


EFFECT = Effect(
    name="gear_losses",
    element=Element.SHAFT,
    title="losses of the gears",
    law="the load gets T_S - l |T_S| sign(w_L); l = l_d where T_S w_L > 0, l_b where it is not",
    source="load-dependent losses of gears: Niemann, Winter, Maschinenelemente II, 2nd ed., 2003; ISO/TR 14179-1",
    excited_by="large torques of both signs, in both directions of motion",
    parameters=(
        EffectParameter(
            "driving_share", "", 0.0, 0.0, 10.0, "share that is lost while the motor drives: l_d", most=0.5
        ),
        EffectParameter("back_share", "", 0.0, 0.0, 10.0, "share while the load drives: l_b", True, most=0.5),
    ),
    example={"driving_share": 0.1, "back_share": 0.06},
    acting=Acting(Place.SHAFT_LOSS, law),
    structures=WITH_SHAFT,
    resembles=("coulomb_friction_load", "coulomb_friction_motor", "torque_nonlinearity", "inverter_gain_mismatch"),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
)
