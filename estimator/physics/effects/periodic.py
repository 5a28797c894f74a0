"""Effects that recur with the motor's angle: ripple of the torque, cardan joints, an unbalanced wheel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import (
    EVERY_LINE,
    WITH_SHAFT,
    Acting,
    Effect,
    EffectParameter,
    Element,
    FitStart,
    Held,
    Place,
    Untestable,
)
from estimator.physics.laws import overtoned_wave, wave
from estimator.physics.motion import goes_round, speed_sweeps, torque_scale
from estimator.signals.record import Record

ORDERS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 18, 20, 24, 30, 36, 48)
"""Periods per motor turn that are tried: pole pairs and slots of usual machines, and their small multiples."""

# A torque ripple whose frequency follows the motor's speed.


@compiled
def ripple_law(
    angle: float,
    amplitude: float,
    share: float,
    order: float,
    in_step: float,
    across: float,
    phase: float,
    share_phase: float,
) -> tuple[float, float]:
    """Return the torque of cogging [Nm], and the share of the drive's own torque by which it ripples."""
    turned = order * angle
    return (
        overtoned_wave(amplitude, turned, phase, in_step, across),
        overtoned_wave(share, turned, share_phase, in_step, across),
    )


def ripple_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return two starts per order that machines show, one per cause; the order is a whole number and not fitted.

    One whose period the motor does not pass through once is any law of the angle, such as gravity.
    """
    return [
        start
        for order in ORDERS
        if goes_round(records, 1.0 / order)
        for start in (
            (0.5, Held(0.0), Held(float(order)), 0.0, 0.0),
            (Held(0.0), 0.5, Held(float(order)), 0.0, 0.0),
        )
    ]


def ripple_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need part of a turn, and a speed that sweeps."""
    if not goes_round(records, 1.0 / ORDERS[-1]):
        return Untestable("the motor makes too little of a turn: nothing recurs with its angle", "reversal")
    if any(speed_sweeps(record) for record in records):
        return None
    return Untestable("the speed hardly changes: a ripple away from the resonance does not show", "reversal")


def ripple_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State size and order of the ripple."""
    torque = unit("torque", motion)
    size = f"{values['amplitude_nm']:.3g} {torque}" if values["amplitude_nm"] else f"{values['share']:.2%} of itself"
    return f"the torque ripples by {size} at {values['order']:.0f} times per motor turn"


TORQUE_RIPPLE = Effect(
    name="torque_ripple",
    element=Element.TORQUE_PATH,
    title="torque ripple",
    law="T = T_read (1 + r w(x)) + A w(x), one of r and A zero, w = cos(x) + a cos(2 x) + b sin(2 x), "
    "x = n phi_M + alpha",
    source="cogging and commutation: Jahns, Soong, IEEE Trans. Ind. Electron. 43(2), 1996",
    excited_by="slow speeds at which n times the speed passes the resonance",
    parameters=(
        EffectParameter("amplitude_nm", "torque", 0.0, 0.0, 20.0, "amplitude A, of cogging", True),
        EffectParameter("share", "", 0.0, 0.0, 20.0, "amplitude as a share of the torque: r", True),
        EffectParameter("order", "", 6.0, 1.0, 96.0, "periods per motor turn: n"),
        EffectParameter("overtone_in_step", "", 0.0, -5.0, 5.0, "twice as often, as a share: a", True),
        EffectParameter("overtone_across", "", 0.0, -5.0, 5.0, "the same a quarter of its turn on: b", True),
        EffectParameter("phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha of A, of each recording", True, True),
        EffectParameter("share_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha of r, of each recording", True, True),
    ),
    acting=Acting(Place.DRIVE_ANGLE, ripple_law),
    structures=EVERY_LINE,
    resembles=("cardan_second_order", "load_imbalance", "resolver_error"),
    phases={"phase_rad": "amplitude_nm", "share_phase_rad": "share"},
    scales=lambda _model, records: (0.05 * torque_scale(records), 0.05, 1.0, 0.1, 0.1),
    starts=ripple_starts,
    testable=ripple_testable,
    text=ripple_sentence,
    waving=True,
)


# Cardan joints at an angle: a torque twice per motor turn in the shaft.


@compiled
def cardan_law(
    angle: float, torque: float, imposed: float, share: float, phase: float, imposed_phase: float, share_phase: float
) -> tuple[float, float, float, float]:
    """Return the torque that the joints add [Nm], a share of the shaft's, the angle they impose [rad], its slope."""
    twice = 2.0 * angle
    return (
        wave(torque, twice, phase),
        wave(share, twice, share_phase),
        wave(imposed, twice, imposed_phase),
        2.0 * wave(imposed, twice, imposed_phase + 0.5 * math.pi),
    )


def cardan_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, the twist that it gives, and a twentieth."""
    torque = 0.05 * torque_scale(records)
    return (torque, torque / model.parameters["k"].value, 0.05)


def cardan_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return one start per cause; each is linear in amplitude and phase together."""
    off = Held(0.0)
    return [(off, 0.5, off), (0.5, off, off), (off, off, 0.5)]


def cardan_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need half a turn of the motor, and a speed that sweeps."""
    if not goes_round(records, 0.5):
        return Untestable("the motor makes less than half a turn: nothing recurs with its angle", "reversal")
    if any(speed_sweeps(record) for record in records):
        return None
    return Untestable("the speed hardly changes: twice per turn stays away from the resonance", "reversal")


def cardan_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the torque twice per turn, or the angle or the share it stands for."""
    size = f"{values['amplitude_nm']:.3g} {unit('torque', motion)}"
    if values["angle_rad"]:
        size = f"the torque of an angle of {values['angle_rad']:.3g} {unit('angle', motion)}"
    elif values["share"]:
        size = f"{values['share']:.2%} of its torque"
    return f"the shaft carries {size} twice per motor turn, as Cardan joints give"


CARDAN_SECOND_ORDER = Effect(
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
    acting=Acting(Place.CARDAN, cardan_law),
    structures=WITH_SHAFT,
    resembles=("torque_ripple", "load_imbalance", "resolver_error"),
    phases={"phase_rad": "amplitude_nm", "angle_phase_rad": "angle_rad", "share_phase_rad": "share"},
    scales=cardan_scales,
    starts=cardan_starts,
    testable=cardan_testable,
    text=cardan_sentence,
    waving=True,
)


# An unbalanced, a little oval wheel: a load torque once and twice per wheel turn.


@compiled
def imbalance_law(angle: float, amplitude: float, turns: float, in_step: float, across: float, phase: float) -> float:
    """Return ``A (cos(x) + a cos(2 x) + b sin(2 x))``, ``x = phi_M / i + alpha`` [Nm], against the load."""
    return overtoned_wave(amplitude, angle / turns, phase, in_step, across)


def imbalance_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a known gear ratio, and a load that makes more than a whole turn."""
    if model.gear_ratio is None:
        reason = "the model file has no [geometry] gear_ratio: the wheel's angle is unknown"
        return Untestable(reason, "reversal", needs="gear_ratio in the model file's [geometry]")
    if not goes_round(records, model.gear_ratio):
        return Untestable("the load makes less than a whole turn: nothing recurs with its angle", "reversal")
    return None


LOAD_IMBALANCE = Effect(
    name="load_imbalance",
    element=Element.LOAD,
    title="imbalance of the load",
    law="T_load = T_0 + A (cos(x) + a cos(2 x) + b sin(2 x)), x = phi_M / i + alpha",
    source="Genta, Dynamics of Rotating Systems, Springer 2005",
    excited_by="speeds at which the wheel's turn is felt",
    parameters=(
        EffectParameter("amplitude_nm", "torque", 0.0, 0.0, 100.0, "amplitude A"),
        EffectParameter("motor_turns_per_turn", "", 1.0, 0.01, 100.0, "motor turns per turn of the load: i", True),
        EffectParameter("overtone_in_step", "", 0.0, -5.0, 5.0, "twice per turn, as a share of A: a", True),
        EffectParameter("overtone_across", "", 0.0, -5.0, 5.0, "the same a quarter of its turn on: b", True),
        EffectParameter("phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha, of each recording", True, True),
    ),
    acting=Acting(Place.RECORDED_ANGLE, imbalance_law),
    structures=EVERY_LINE,
    resembles=("torque_ripple", "cardan_second_order", "road_grade"),
    phases={"phase_rad": "amplitude_nm"},
    scales=lambda _model, records: (0.05 * torque_scale(records), 1.0, 0.1, 0.1),
    starts=lambda model, _records: [(0.5, Held(model.gear_ratio or 1.0), 0.0, 0.0)],
    testable=imbalance_testable,
    text="the load torque swings by {amplitude_nm:.3g} {unit[torque]} once per wheel turn",
    waving=True,
)
