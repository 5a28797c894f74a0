"""Inertias that come and go, and one more with a spring of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimator.compiled import compiled
from estimator.physics.driveline import Driveline, Motion, load_inertia, natural_frequencies_rad_s, unit
from estimator.physics.effect import (
    EVERY_LINE,
    MOMENTS,
    WITH_SHAFT,
    Acting,
    Effect,
    EffectParameter,
    Element,
    FitStart,
    Held,
    OtherForm,
    Place,
    Span,
    Step,
    Within,
)
from estimator.physics.laws import inertia_while, share_inside
from estimator.signals.record import Record

MOST_DAMPING = 0.15  # steel shafts and their rubber couplings stay below this damping ratio of their own
LEAST_AMPLIFIED = 2.0  # by which a resonance amplifies at least, ``1 / (2 zeta)``, whatever damps it

LIGHTEST, STIFFEST = 0.03, 0.95
"""Inertia within the line, over the motor's, and share of the twist on the shaft behind it, beyond which it
would take too many steps to follow them."""

MOST_INERTIA = 50.0  # most inertia, in tenths of the motor's

SOFTEST = 0.4
"""Share of the twist on the shaft below which the shaft would be the stiffer of both springs by far."""

NEAR_HALF_RATE = 0.4
"""Frequency over the sampling rate up to which an inertia within the line is looked for: from farther above a
fit may end at its image on the other side of half the rate."""

ABOVE = 5.0  # frequency over the line's own near which it is looked for where the samples are fast


# The clutch to the generator is not open: its inertia turns with the motor for a while.


@compiled
def with_more_law(inertia: float, time_s: float, length_s: float, extra: float, from_s: float, to_s: float) -> float:
    """Return an inertia with another one on it from one moment to the next [kg m^2]."""
    return inertia_while(inertia, extra, share_inside(time_s, length_s, from_s, to_s))


GENERATOR_COUPLED = Effect(
    name="generator_coupled",
    element=Element.MOTOR,
    title="generator coupled",
    law="J_M becomes J_M + J_G from t_1 to t_2 of a recording",
    source="hybrid bus whose coupling to the generator opens: Nevaranta, Montonen, Lindh, EPE'18, 2018",
    excited_by="PRBS or torque steps while the clutch is closed",
    parameters=(
        EffectParameter("inertia_kg_m2", "inertia", 0.0, 0.0, 20.0, "inertia that is coupled: J_G"),
        *MOMENTS,
    ),
    acting=Acting(Place.MOTOR_INERTIA, with_more_law),
    structures=EVERY_LINE,
    resembles=("stiffness_change", "brake_drag", "inertia_change"),
    event=True,
    scales=lambda model, _records: (0.5 * model.parameters["J_M"].value,),
    starts=lambda _model, _records: [(0.3,), (1.5,)],
    text="an extra inertia of {inertia_kg_m2:.3g} {unit[inertia]} turns with the motor: clutch not open",
    linear=True,
)


# The payload steps: people get on or off.


def payload_described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the load's inertia before and after the change."""
    name = load_inertia(model)
    before, after = line[name], line[name] + values["change_kg_m2"]
    return {name: ((before, before), (after, after))}


INERTIA_CHANGE = Effect(
    name="inertia_change",
    element=Element.LOAD,
    title="step of the payload",
    law="J_L becomes J_L + delta from t_1 to t_2 of a recording",
    source="the vehicle's mass at the wheel, m r^2: Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992",
    excited_by="acceleration before and after the change",
    parameters=(
        EffectParameter("change_kg_m2", "inertia", 0.0, -7.0, 40.0, "change of the inertia: delta"),
        *MOMENTS,
    ),
    acting=Acting(Place.LOAD_INERTIA, with_more_law),
    structures=EVERY_LINE,
    resembles=("generator_coupled", "road_grade"),
    event=True,
    step=Step(load_inertia),
    scales=lambda model, _records: (0.1 * model.parameters[load_inertia(model)].value,),
    starts=lambda _model, _records: [(-1.0,), (1.0,)],
    text="the load's inertia changes by {change_kg_m2:+.3g} {unit[inertia]} during the recording",
    described=payload_described,
    linear=True,
)


# One more inertia on a spring: a second resonance that the model does not have.


@compiled
def frequency_within(inertia: float, stiffness: float, line_share: float) -> float:
    """Return the frequency [rad/s] of an inertia [kg m^2] on the spring that softens a shaft [Nm/rad] to this share."""
    return math.sqrt(stiffness * line_share / ((1.0 - line_share) * inertia))


def mode_within(values: Mapping[str, float]) -> float:
    """Return the inertia within the line [kg m^2], before the shaft or behind it; 0 for one next to it."""
    return values.get("between_kg_m2", 0.0) + values.get("behind_kg_m2", 0.0)


def mode_derived(values: Mapping[str, float], nominal: Mapping[str, float]) -> Mapping[str, float]:
    """Return the frequency [Hz] of an inertia within the line: it is not fitted but follows."""
    if not mode_within(values):
        return {}
    fastest = frequency_within(mode_within(values), nominal["k"], values["line_share"])
    return {"frequency_hz": fastest / (2.0 * math.pi)}


def mode_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a tenth of the motor's inertia, the line's own frequency, 1, a usual damping, and that inertia twice."""
    frequency = float(natural_frequencies_rad_s(model.values())[0]) / (2.0 * math.pi)
    tenth = 0.1 * model.parameters["J_M"].value
    return (tenth, frequency, 1.0, 0.05, tenth, tenth)


def mode_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return heavy modes far above the first resonance, and light ones below, around and above it.

    The heavy ones come first: where only what their spring does to the line shows, nothing else distinguishes them. An
    inertia within the line is looked for from where such a branch has been fitted (``retold``).
    """
    none = Held(0.0)
    heavy = [(1.5, ratio, 0.95, 1.0, none, none) for ratio in (3.0, 4.0, 5.0, 6.0)]
    light = [(0.2, float(ratio), 1.0, 1.0, none, none) for ratio in np.geomspace(0.3, 5.0, 24)]
    return [*heavy, *light]


def mode_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return an inertia before the shaft and one behind it that leave the line as compliant and as heavy as a branch.

    Its spring and the shaft's are as soft together, within what ``k`` is trusted to. Well below its resonance it moves
    by s with the side of its own spring, by 1 - s with the other. One behind the shaft swings against both springs
    while the motor stands: at the branch's frequency.
    """
    if mode_within(values):
        return []
    trusted, stiffness = model.parameters["k"], line["k"] * values["line_share"]
    low = max(stiffness / (trusted.value * (1.0 + trusted.tolerance)), SOFTEST)
    high = min(stiffness / (trusted.value * max(1.0 - trusted.tolerance, SOFTEST)), STIFFEST)
    if low >= high:
        low, high = SOFTEST, STIFFEST
    *_, usual, tenth, _ = mode_scales(model, records)
    share = 0.5 * (low + high)
    own, branch = float(natural_frequencies_rad_s(model.values())[0]), 2.0 * math.pi * values["frequency_hz"]
    slowest = max(record.sample_time_s for record in records)
    before = min(ABOVE * own, 2.0 * math.pi * NEAR_HALF_RATE / slowest)
    behind = min(before, math.sqrt(share) * branch) if branch > own else before
    none, motor, load = Held(0.0), line["J_M"] + values["inertia_kg_m2"], line["J_L"]
    shaped = none, Held(1.0), Within(share, SOFTEST, STIFFEST), Within(1.0, 0.02, MOST_DAMPING / usual)

    def reparametrisation(omega: float, at_motor: bool) -> OtherForm:
        inertia = stiffness / ((1.0 - share) * omega**2)
        size = Within(min(max(inertia / tenth, 10.0 * LIGHTEST), MOST_INERTIA), 10.0 * LIGHTEST, MOST_INERTIA)
        of_motor, of_load = (share, 1.0 - share) if at_motor else (1.0 - share, share)
        lighter = {"J_M": motor - of_motor**2 * inertia, "J_L": load - of_load**2 * inertia}
        return OtherForm((*shaped, *((size, none) if at_motor else (none, size))), {"k": stiffness / share, **lighter})

    return [reparametrisation(before, at_motor=True), reparametrisation(behind, at_motor=False)]


def mode_described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the shaft's stiffness and that of the whole line, any damping, and the inertias with the further one."""
    more = mode_within(values) or values["inertia_kg_m2"]
    whole = line["k"] * values["line_share"]
    inertias = {name: ((line[name], line[name] + more),) for name in ("J_M", "J_L")}
    return {"k": ((whole, line["k"]),), "c": ((0.0, math.inf),), **inertias}


def mode_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State inertia, place and frequency of the further mode."""
    place = f"{mode_within(values) or values['inertia_kg_m2']:.3g} {unit('inertia', motion)} on a spring"
    if values.get("between_kg_m2"):
        place += " between motor and shaft"
    if values.get("behind_kg_m2"):
        place += " between shaft and load"
    return (
        f"the line has one more torsional mode: {place}, "
        f"{values['frequency_hz']:.3g} Hz by itself with damping ratio {values['damping_ratio']:.2g}"
    )


def mode_implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a mode damped so much that it has no resonance to speak of, and to one too light or stiff to follow.

    A branch that stands for an inertia within the line is damped by the shaft next to it, too: ``c / (2 J_X w)`` comes
    on top of its own.
    """
    if inertia := mode_within(values):
        if inertia <= 1.01 * LIGHTEST * model.parameters["J_M"].value:
            return f"{inertia:.2g} {unit('inertia', model.motion)} within the line are too little to be reported"
        belongs = "motor" if values.get("between_kg_m2") else "load"
        too_stiff = values["line_share"] >= 0.99 * STIFFEST
        return f"an inertia on so stiff a spring belongs to the {belongs}" if too_stiff else ""
    impedance = 4.0 * math.pi * values["inertia_kg_m2"] * values["frequency_hz"]
    if impedance == 0.0:
        return "a branch without inertia is no mode"
    most = min(MOST_DAMPING + model.parameters["c"].value / impedance, 0.5 / LEAST_AMPLIFIED)
    if values["damping_ratio"] <= most:
        return ""
    return f"a branch with damping ratio {values['damping_ratio']:.2g} is no mode"


EXTRA_TORSIONAL_MODE = Effect(
    name="extra_torsional_mode",
    element=Element.SHAFT,
    title="one more torsional mode",
    law="J_X dw_X/dt = k_X (phi_M - phi_X) + c_X (w_M - w_X), reacting on the motor; k_X = J_X (2 pi f)^2; "
    "T_S = s k twist + s^2 c d twist/dt, s < 1 where the spring is in the line; or between "
    "motor and shaft: J_X dw_X/dt = k_X (phi_M - phi_X) + c_X (w_M - w_X) - T_S, k_X = k s / (1 - s); or between shaft "
    "and load: J_X dw_X/dt = T_S - k_X (phi_X - phi_L) - c_X (w_X - w_L)",
    source="an inertia on a spring next to the main one: Den Hartog, Mechanical Vibrations, 4th ed., 1956",
    excited_by="PRBS that reaches the mode's frequency",
    parameters=(
        EffectParameter("inertia_kg_m2", "inertia", 0.0, 0.0, MOST_INERTIA, "inertia next to the line: J_X", True),
        EffectParameter("frequency_hz", "Hz", 1.0, 0.05, 8.0, "its frequency with the motor held: f"),
        EffectParameter(
            "line_share", "", 1.0, SOFTEST, 1.0, "share of the twist that the main shaft has: s", True, most=1.0
        ),
        EffectParameter("damping_ratio", "", 0.05, 0.02, 8.0, "its damping ratio: c_X / (2 sqrt(k_X J_X))"),
        EffectParameter(
            "between_kg_m2", "inertia", 0.0, 0.0, MOST_INERTIA, "inertia between motor and shaft instead: J_X", True
        ),
        EffectParameter(
            "behind_kg_m2", "inertia", 0.0, 0.0, MOST_INERTIA, "inertia between shaft and load instead: J_X", True
        ),
    ),
    structures=WITH_SHAFT,
    resembles=("actuator_lag", "stiffness_nonlinearity", "tyre_slip", "speed_filter"),
    scales=mode_scales,
    starts=mode_starts,
    text=mode_sentence,
    widens=frozenset({"k", "c"}),  # a spring in the line softens it by s and lowers its damping by s^2
    described=mode_described,
    implausible=mode_implausible,
    reparametrised=mode_reparametrised,
    derived=mode_derived,
    linear=True,
)
