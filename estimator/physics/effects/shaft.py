"""Effects in the shaft: a gap, a spring that is not linear, steps, yields or relaxes, cardan joints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, Structure, natural_frequencies_rad_s, unit
from estimator.physics.effect import (
    MOMENTS,
    WITH_SHAFT,
    WITH_SPRING,
    Acting,
    Around,
    Effect,
    EffectParameter,
    Element,
    FitStart,
    Held,
    OtherForm,
    Place,
    Span,
    Step,
    Untestable,
    long_enough,
)
from estimator.physics.laws import beyond_gap, fading, power, share_inside
from estimator.physics.motion import torque_reverses, torque_scale
from estimator.signals.record import Record

# Backlash: a gap in the line that the twist must cross before the shaft carries torque.

CONTACT_PER_GAP = 0.05
"""Depth of contact of a simulated joint that was given none: faces of steel are rounded by far less than their gap."""


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


def gap_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a fifth of the twist that the torque in use gives, a twentieth of that for the contact depth, and 1s."""
    twist = torque_scale(records) / model.parameters["k"].value
    return (0.2 * twist, 0.01 * twist, 1.0, 1.0)


def gap_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return a ladder of gap sizes: a gap that is too large or too small is a local optimum."""
    contact: float | Held = Held(0.0) if model.structure is Structure.JOINT else 1.0
    pull: float | Held = Held(0.0) if model.structure is Structure.JOINT else 0.5
    return [(size, contact, pull, Held(0.0)) for size in (0.1, 0.4, 1.2, 3.6)]


def gap_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return the gap that was found with the damper across it, which its faces then do not share."""
    if values["across"] > 0.0:
        return []
    return [OtherForm((values["gap_rad"] / gap_scales(model, records)[0], Held(0.0), Held(0.0), Held(1.0)), {})]


def gap_completed(values: Mapping[str, float]) -> Mapping[str, float]:
    """Give a gap without a depth of contact one: damping all at once would kick the motor at every touch."""
    return {"contact_rad": CONTACT_PER_GAP * values.get("gap_rad", 0.0), **values}


def gap_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need torque of both signs, so that the gap is crossed."""
    if any(torque_reverses(record) for record in records):
        return None
    return Untestable("the shaft torque never changes sign: the gap stays closed on one side", "reversal")


BACKLASH = Effect(
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
    scales=gap_scales,
    starts=gap_starts,
    testable=gap_testable,
    reparametrised=gap_reparametrised,
    text="the shaft has a backlash of {gap_rad:.3g} {unit[angle]} in total",
    completed=gap_completed,
    shows_start=frozenset({"twist", "preload"}),
)


# A shaft that hardens or softens with twist.


@compiled
def stiffness_factor(twist: float, hardening: float, shape: float) -> float:
    """Return the factor on the stiffness, ``(1 + |h| e^2 / m)^(+-m)`` with the sign of h.

    To first order it is ``1 + h e^2`` whatever the shape m. A hardening shaft with m = 1 is the Duffing spring; a
    softening one with m = 1/2 ends in a constant torque, and none ever pulls the wrong way.
    """
    if every(hardening == 0.0):
        return 1.0
    size = 1.0 + abs(hardening) * twist * twist / shape
    return power(size, choose(hardening > 0.0, shape, -shape))


@compiled
def spring_law(twist: float, hardening: float, shape: float, stage: float, stage_from: float) -> float:
    """Return the twist at which a linear shaft carries the same torque [rad]."""
    same = twist * stiffness_factor(twist, hardening, shape)
    if every(stage == 0.0):
        return same
    return same + stage * beyond_gap(twist, 2.0 * stage_from)


def stiffness_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return the hardening for a fifth more stiffness at the twist of the torque in use, 1 twice, and that twist."""
    twist = torque_scale(records) / model.parameters["k"].value
    return (0.2 / twist**2, 1.0, 1.0, twist)


def stiffness_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return a hardening and a softening start, without a second stage."""
    one = Held(0.0), Held(0.0)
    return [(0.5, 1.0, *one), (-0.5, 0.5, *one)]


def stiffness_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return a shaft of two stages that hardens or softens as the one that was found, from small and larger twists."""
    if values["stage_share"] != 0.0:
        return []
    share = math.copysign(0.3, values["hardening_per_rad2"])
    return [OtherForm((Held(0.0), Held(1.0), share, begins), {}) for begins in (0.2, 0.5)]


def stiffness_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the stages, or at which twist the stiffness has changed by a tenth."""
    if stage := values.get("stage_share", 0.0):
        side, at = ("stiffer", values["stage_rad"]) if stage > 0 else ("softer", values["stage_rad"])
        return f"the shaft has two stages: {abs(stage):.0%} {side} beyond a twist of {at:.3g} {unit('angle', motion)}"
    hardening, shape = values["hardening_per_rad2"], values["shape"]
    kind, changed = ("hardens", 1.1) if hardening > 0 else ("softens", 1.0 / 0.9)
    twist = math.sqrt(shape * (math.pow(changed, 1.0 / shape) - 1.0) / abs(hardening))
    return f"the shaft {kind} with twist: by a tenth of its stiffness at {twist:.3g} {unit('angle', motion)}"


STIFFNESS_NONLINEARITY = Effect(
    name="stiffness_nonlinearity",
    element=Element.SHAFT,
    title="hardening or softening shaft",
    law="T_S = k e (1 + |h| e^2 / m)^(m sign h) + c de/dt; of two stages T_S = k e + s k (e beyond +-e_2) + c de/dt",
    source="Duffing spring; for couplings: DIN 740-2 (progressive characteristic)",
    excited_by="large and small shaft torques in the same set of tests",
    parameters=(
        EffectParameter("hardening_per_rad2", "per_angle_squared", 0.0, -200.0, 200.0, "relative stiffness change h"),
        EffectParameter("shape", "", 1.0, 0.1, 3.0, "how the change continues at large twist: m", True),
        EffectParameter("stage_share", "", 0.0, -1.0, 10.0, "stiffness a second stage adds, over k: s", True, least=-1),
        EffectParameter("stage_rad", "angle", 0.0, 0.02, 1.0, "twist from which on it is loaded: e_2", True),
    ),
    acting=Acting(Place.SPRING, spring_law),
    either=("hardening_per_rad2", "stage_share"),
    structures=WITH_SPRING,
    resembles=("torque_saturation", "backlash", "stiffness_change", "shaft_hysteresis", "extra_torsional_mode"),
    scales=stiffness_scales,
    starts=stiffness_starts,
    text=stiffness_sentence,
    reparametrised=stiffness_reparametrised,
    widens=frozenset({"k", "c"}),  # of an oscillation whose frequency goes with its size a linear line damps the beats
    shows_start=frozenset({"twist"}),
)


# The shaft's stiffness steps at a moment, as when it cracks.


@compiled
def cracked_law(stiffness: float, time_s: float, length_s: float, change: float, from_s: float, to_s: float) -> float:
    """Return a stiffness that is changed by a share of itself from one moment to the next [Nm/rad]."""
    return stiffness * (1.0 + share_inside(time_s, length_s, from_s, to_s) * change)


def stiffness_step_described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the stiffness before and after the change."""
    before, after = line["k"], line["k"] * (1.0 + values["change"])
    return {"k": ((before, before), (after, after))}


STIFFNESS_CHANGE = Effect(
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
    acting=Acting(Place.STIFFNESS, cracked_law),
    structures=WITH_SPRING,
    resembles=("generator_coupled", "backlash", "stiffness_nonlinearity"),
    event=True,
    step=Step(lambda _model: "k", relative=True, lasting=True),
    scales=lambda _model, _records: (1.0,),
    starts=lambda _model, _records: [(-0.2,), (0.2,)],
    text="the shaft's stiffness changes by {change:+.1%} during the recording",
    described=stiffness_step_described,
    linear=True,
    shows_start=frozenset({"twist"}),
)


# Dry friction inside the shaft line: the torque lags the twist whatever the speed.


@compiled
def loading_rate(loading: float, rate: float, sharpness: float, unloading: float, fastest: float) -> float:
    """Return how fast the slider loads [1/s]: towards 1 against the motion, and no further."""
    pace = min(abs(rate), fastest)
    yielded = power(min(abs(loading), 1.0), sharpness)
    yielded = choose(rate * loading < 0.0, -unloading * yielded, yielded)
    return pace * math.copysign(1.0 - yielded, rate)


@compiled
def slider_law(
    twist: float,
    rate: float,
    loading: float,
    around: Around,
    friction: float,
    yields: float,
    sharpness: float,
    unloading: float,
    inside: float,
) -> float:
    """Return the torque of a slider that is loaded from -1 to 1, less what it takes of the shaft's own spring [Nm]."""
    return friction * loading - min(inside * friction / yields, around.stiffness) * twist


@compiled
def slider_rate(
    twist: float,
    rate: float,
    loading: float,
    around: Around,
    friction: float,
    yields: float,
    sharpness: float,
    unloading: float,
    inside: float,
) -> float:
    """Return how fast it loads [1/s]; it yields over no shorter a twist than the step can follow."""
    over = max(yields, friction / around.stiffest)
    return loading_rate(loading, rate / over, sharpness, unloading, around.fastest)


def slider_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, a fiftieth of the twist that it gives, and 1 for the shape."""
    torque = torque_scale(records)
    return (0.05 * torque, 0.02 * torque / model.parameters["k"].value, 1.0, 1.0, 1.0)


def slider_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return two starts: a slider that yields early and one that yields late."""
    early, late = (Held(0.0), Held(0.0)) if model.structure is Structure.JOINT else (0.2, 0.5)
    return [(0.5, 0.5, 1.0, 0.7, early), (1.0, 4.0, 1.0, 0.7, late)]


SHAFT_HYSTERESIS = Effect(
    name="shaft_hysteresis",
    element=Element.SHAFT,
    title="hysteresis of the shaft",
    law="T_S = (k - m T_h / y) twist + c r + T_h z, dz/dt = r (1 - |z|^n) / y, back r (1 + u |z|^n) / y, "
    "r = d twist/dt",
    source="Bouc-Wen: Wen, J. Eng. Mech. Div. ASCE 102, 1976; n = u = 1: Dahl, AIAA J. 14(12), 1976",
    excited_by="torque of both signs, small and large amplitudes",
    parameters=(
        EffectParameter("friction_nm", "torque", 0.0, 0.0, 40.0, "friction torque of the slider: T_h"),
        EffectParameter("yield_rad", "angle", 1.0, 0.1, 100.0, "twist over which it yields: y"),
        EffectParameter("sharpness", "", 1.0, 0.2, 20.0, "how suddenly it yields: n", True),
        EffectParameter("unloading", "", 1.0, 0.0, 1.0, "stiffness on the way back: u", True, most=1.0),
        EffectParameter("inside", "", 0.0, 0.0, 1.0, "part of its stiffness that k holds: m", True, most=1.0),
    ),
    acting=Acting(Place.SHAFT, slider_law, slider_rate),
    structures=WITH_SPRING,
    resembles=("coulomb_friction_motor", "backlash", "stiffness_nonlinearity"),
    scales=slider_scales,
    starts=slider_starts,
    text="the shaft line has dry friction inside: {friction_nm:.3g} {unit[torque]}, yielding over "
    "{yield_rad:.3g} {unit[angle]}",
)


# A shaft that relaxes: rubber in a coupling is a spring in series with a damper, next to the shaft's own spring.


@compiled
def relaxing_law(twist: float, rate: float, torque: float, around: Around, share: float, relaxation_s: float) -> float:
    """Return the torque of the branch, which is its state [Nm]."""
    return torque


@compiled
def relaxing_rate(twist: float, rate: float, torque: float, around: Around, share: float, relaxation_s: float) -> float:
    """Return how fast it changes [Nm/s]; no faster than the step can follow."""
    return (share * around.stiffness * relaxation_s * rate - torque) * min(1.0 / relaxation_s, around.fastest)


def relaxation_described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the stiffness from slow to fast, and the damping with and without the branch."""
    stiffness = line["k"] * values["branch_share"]
    return {
        "k": ((line["k"], line["k"] + stiffness),),
        "c": ((line["c"], line["c"] + stiffness * values["relaxation_s"]),),
    }


VISCOELASTIC_SHAFT = Effect(
    name="viscoelastic_shaft",
    element=Element.SHAFT,
    title="relaxation of the shaft",
    law="T_S = k twist + c r + T_r, dT_r/dt = n k r - T_r / tau, r = d twist/dt",
    source="the standard linear solid (Zener): Lakes, Viscoelastic Materials, Cambridge 2009, ch. 2",
    excited_by="PRBS well below and around the line's resonance",
    parameters=(
        EffectParameter("branch_share", "", 0.0, 0.0, 40.0, "stiffness of the branch over the shaft's: n"),
        EffectParameter("relaxation_s", "s", 1.0, 0.05, 20.0, "time in which its torque relaxes: tau"),
    ),
    example={"branch_share": 0.4, "relaxation_s": 0.02},
    acting=Acting(Place.SHAFT, relaxing_law, relaxing_rate),
    structures=WITH_SHAFT,
    resembles=("extra_torsional_mode", "shaft_hysteresis", "stiffness_nonlinearity", "actuator_lag"),
    widens=frozenset({"k", "c"}),  # the branch stiffens the line and damps it
    scales=lambda model, _records: (0.1, 1.0 / float(natural_frequencies_rad_s(model.values())[0])),
    starts=lambda _model, _records: [(3.0, time) for time in (0.3, 1.0, 3.0)],
    described=relaxation_described,
    unresolved=long_enough("relaxation_s"),
    text="the shaft is stiffer when twisted fast, by {branch_share:.1%}, and relaxes with a time constant "
    "of {relaxation_ms:.3g} ms",
    linear=True,
)
