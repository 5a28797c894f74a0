"""Cardan joints at an angle: a torque twice per motor turn in the shaft."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import WITH_SHAFT, Effect, EffectParameter, Element, Held, Start, Untestable
from estimator.physics.motion import goes_round, speed_sweeps, torque_scale
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, the twist that it gives, and a twentieth."""
    torque = 0.05 * torque_scale(records)
    return (torque, torque / model.parameters["k"].value, 0.05)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start per cause; each is linear in amplitude and phase together."""
    off = Held(0.0)
    return [(off, 0.5, off), (0.5, off, off), (off, off, 0.5)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need speeds at which twice per turn is near the resonance."""
    if not goes_round(records, 0.5):
        return Untestable("the motor makes less than half a turn: nothing recurs with its angle", "reversal")
    if any(speed_sweeps(record) for record in records):
        return None
    return Untestable("the speed hardly changes: twice per turn stays away from the resonance", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    size = f"{values['amplitude_nm']:.3g} {unit('torque', motion)}"
    if values["angle_rad"]:
        size = f"the torque of an angle of {values['angle_rad']:.3g} {unit('angle', motion)}"
    elif values["share"]:
        size = f"{values['share']:.2%} of its torque"
    return f"the shaft carries {size} twice per motor turn, as Cardan joints give"


EFFECT = Effect(
    name="cardan_second_order",
    element=Element.SHAFT,
    title="second order of the Cardan joints",
    law="T_S = (k e + c de/dt) (1 + r cos(2 phi_M + alpha)) + A cos(2 phi_M + alpha), "
    "e = twist + a cos(2 phi_M + alpha), two of a, A and r zero; on the motor T_S de/dtwist",
    source="Seherr-Thoss, Schmelz, Aucktor: Universal Joints and Driveshafts, 2nd ed., Springer 2006",
    excited_by="slow speeds at which twice per turn passes the resonance",
    parameters=(
        EffectParameter("amplitude_nm", "torque", 0.0, 0.0, 40.0, "torque twice per turn: A", True),
        EffectParameter("angle_rad", "angle", 0.0, 0.0, 40.0, "angle error of the joints: a", True),
        EffectParameter("share", "", 0.0, 0.0, 20.0, "torque as a share of the shaft's: r", True),
        EffectParameter("phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha of A, of each recording", True, True),
        EffectParameter("angle_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha of a, of each recording", True, True),
        EffectParameter("share_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha of r, of each recording", True, True),
    ),
    structures=WITH_SHAFT,
    resembles=("torque_ripple", "load_imbalance", "resolver_error"),
    phases={"phase_rad": "amplitude_nm", "angle_phase_rad": "angle_rad", "share_phase_rad": "share"},
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    waving=True,
)
