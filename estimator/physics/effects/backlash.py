"""Backlash: a gap in the line that the twist must cross before the shaft carries torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, Structure, unit
from estimator.physics.effect import WITH_SPRING, Effect, EffectParameter, Element, Held, Retelling, Start, Untestable
from estimator.physics.laws import fading
from estimator.physics.motion import torque_reverses, torque_scale
from estimator.signals.record import Record


@compiled
def damping_share(loaded_twist: float, contact: float) -> float:
    """Return how much of the shaft's damping acts: 0 in the gap, rising to 1 over the contact depth.

    Damping that switched on at full size at first touch would pull the faces together and kick the motor; flanks
    in contact squeeze out their play first (Hunt and Crossley, J. Appl. Mech. 42, 1975). No depth: all at once.
    """
    at_once = choose(loaded_twist == 0.0, 0.0, 1.0)
    if every(contact <= 0.0):
        return at_once
    return choose(contact <= 0.0, at_once, 1.0 - fading(abs(loaded_twist) / contact))


@compiled
def pressed(torque: float, loaded_twist: float, pull: float) -> float:
    """Return the torque that the faces of a gap pass on: they press; a film of oil between them may also pull."""
    passed_on = choose(torque * loaded_twist > 0.0, torque, pull * torque)
    return choose(loaded_twist == 0.0, 0.0, passed_on)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a fifth of the twist that the torque in use gives, a twentieth of that for the contact depth, and 1s."""
    twist = torque_scale(records) / model.parameters["k"].value
    return (0.2 * twist, 0.01 * twist, 1.0, 1.0)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a ladder of gap sizes: a gap that is too large or too small is a local optimum.

    On a bench nothing can bounce, and the damping engages at once.
    """
    contact: float | Held = Held(0.0) if model.structure is Structure.JOINT else 1.0
    pull: float | Held = Held(0.0) if model.structure is Structure.JOINT else 0.5
    return [(size, contact, pull, Held(0.0)) for size in (0.1, 0.4, 1.2, 3.6)]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the gap that was found with the damper across it, which its faces then do not share."""
    if values["across"] > 0.0:
        return []
    return [Retelling((values["gap_rad"] / scales(model, records)[0], Held(0.0), Held(0.0), Held(1.0)), {})]


CONTACT_PER_GAP = 0.05
"""Depth of contact of a simulated joint that was given none: faces of steel are rounded by far less than their gap."""


def completed(values: Mapping[str, float]) -> Mapping[str, float]:
    """Give a gap without a depth of contact one: damping all at once would kick the motor at every touch."""
    return {"contact_rad": CONTACT_PER_GAP * values.get("gap_rad", 0.0), **values}


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need torque of both signs, so that the gap is crossed."""
    if any(torque_reverses(record) for record in records):
        return None
    return Untestable("the shaft torque never changes sign: the gap stays closed on one side", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the shaft has a backlash of {values['gap_rad']:.3g} {unit('angle', motion)} in total"


EFFECT = Effect(
    name="backlash",
    element=Element.SHAFT,
    title="backlash in the shaft line",
    law="T_S = k e + c (1 - exp(-|e|/e_c)) de/dt, times q where that pulls; e = twist beyond +-gap/2; with the damper "
    "across the gap T_S = k e + c d(twist)/dt",
    source="Nordin, Gutman: Automatica 38(10), 2002; contact damping after Hunt, Crossley 1975",
    excited_by="shaft torque that changes sign: reversal, tip-in and tip-out",
    parameters=(
        EffectParameter("gap_rad", "angle", 0.0, 0.0, 20.0, "total gap"),
        EffectParameter("contact_rad", "angle", 0.0, 0.02, 20.0, "depth over which the damping engages: e_c", True),
        EffectParameter("pull", "", 0.0, 0.0, 1.0, "share of a pull that an oil film passes on: q", True, most=1.0),
        EffectParameter(
            "across",
            "",
            0.0,
            0.0,
            1.0,
            "share of the damping that acts across the gap, too",
            True,
            most=1.0,
            form="damper across the gap",
        ),
    ),
    structures=WITH_SPRING,
    resembles=(
        "coulomb_friction_motor",
        "stribeck_friction",
        "stiffness_nonlinearity",
        "stiffness_change",
        "shaft_hysteresis",
    ),
    scales=scales,
    starts=starts,
    testable=testable,
    retold=retold,
    sentence=sentence,
    completed=completed,
    shows_start=frozenset({"twist", "preload"}),
)
