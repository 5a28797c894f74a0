"""Viscous friction at the motor that is not the same forward and backward: seals, helical gears, worn bearings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Acting, Effect, EffectParameter, Element, Place, Start, Untestable
from estimator.physics.motion import reverses, speed_by_place, speed_scale, torque_scale
from estimator.signals.record import Record

BY_PLACE = 0.5
"""Share of the speed's variance that may go with the place: beyond it most of the law would be a torque over it."""


@compiled
def law(speed: float, difference: float) -> float:
    """Return ``d |w|``: what is more forward is less backward [Nm]."""
    return difference * abs(speed)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use at the top speed."""
    return (0.05 * torque_scale(records) / speed_scale(records),)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start of either sign: the problem is linear in it but for the sign of ``b_M`` within its bounds."""
    return [(0.5,), (-0.5,)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need motion in both directions, and at each place at different speeds."""
    both = [record for record in records if reverses(record)]
    if not both:
        return Untestable("the speed never changes sign: not separable from viscous friction", "reversal")
    if min(speed_by_place(record) for record in both) > BY_PLACE:
        return Untestable("each place is passed at one speed: not separable from a torque over the angle", "reversal")
    return None


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    size = f"{abs(values['difference_nm_s']):.3g} {unit('damping', motion)}"
    more, less = ("forward", "backward") if values["difference_nm_s"] > 0.0 else ("backward", "forward")
    return f"friction at the motor depends on the direction: {size} more {more} and as much less {less}"


EFFECT = Effect(
    name="asymmetric_friction",
    element=Element.MOTOR,
    title="friction by direction",
    law="T_f = d |w_M|: b_M + d forward, b_M - d backward; dry friction that differs is a constant load torque",
    source="friction by direction: Kelly, Davila Santibáñez, Loría, Control of Robot Manipulators, Springer 2005",
    excited_by="motion in both directions at different speeds",
    parameters=(EffectParameter("difference_nm_s", "damping", 0.0, -40.0, 40.0, "half the difference: d"),),
    example={"difference_nm_s": 3.0},
    acting=Acting(Place.MOTOR, law),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "road_grade", "torque_nonlinearity"),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
)
