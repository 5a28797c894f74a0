"""Effects of the torque path on its size: gain, limits, derating, offset, ripple."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.driveline import Driveline, Load, Motion, unit
from estimator.physics.effect import (
    EVERY_LINE,
    Acting,
    Effect,
    EffectParameter,
    Element,
    FitStart,
    Held,
    OtherForm,
    Place,
    Untestable,
)
from estimator.physics.motion import (
    largest_torque,
    longest_s,
    shares_differ,
    torque_reverses,
    torque_scale,
)
from estimator.signals.record import FloatArray, Record

# One inverter gives more or less torque than its reading says.

IN_PROPORTION = ("inertia", "stiffness", "damping", "torque", "quadratic_drag")
"""Dimensions that change with the torque."""

QUICKEST = 0.04
"""Shortest time constant in lengths of the longest recording: a loss that is complete before anything can have warmed
is a gain, or what a recording began with."""

EDGE = 100.0  # sharpness from which on a knee is an edge

SPREAD = 0.3  # share of the largest torque by which its size must differ: about one size any law is a gain

LEAST_S = 8.0  # a drift shows in recordings of this length: in less it is the noise of the reading


def gain_law(torque: FloatArray, inverter: int, gain_m1: float, gain_m2: float) -> FloatArray:
    """Return the torque of an inverter that acts [Nm]; of a third one its reading."""
    return torque * (gain_m1 if inverter == 0 else gain_m2 if inverter == 1 else 1.0)


def gain_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need two inputs whose ratio changes, or else a wrong gain is a change of all other parameters."""
    if any(record.torque_nm.shape[1] < 2 for record in records):
        return Untestable("there is one torque input only: its gain is that of all other parameters", "cruise")
    if shares_differ(records):
        return None
    return Untestable(
        "both inverters carry the same share all along: a wrong gain of one is a change of all other parameters. "
        "Let the other one carry the PRBS in one recording",
        "cruise",
    )


def gain_rescaled(values: Mapping[str, float]) -> Mapping[str, float]:
    """Return what every torque is multiplied by where the other inverter is the wrong one: only their ratio shows."""
    return dict.fromkeys(IN_PROPORTION, 1.0 / (values["gain_m1"] * values["gain_m2"]))


def gain_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the gain of either inverter: the recordings determine only the ratio."""
    wrong, right = ("m1", "m2") if values["gain_m1"] != 1.0 else ("m2", "m1")
    gain = values[f"gain_{wrong}"]
    return (
        f"the true torque of inverter {wrong} is {gain:.3g} times its reading; or that of {right} is {1.0 / gain:.3g} "
        "times, with every inertia, stiffness and friction scaled by the same: the recordings determine only the ratio"
    )


INVERTER_GAIN_MISMATCH = Effect(
    name="inverter_gain_mismatch",
    element=Element.TORQUE_PATH,
    title="gain of one inverter",
    law="T = g_1 T_M1 + g_2 T_M2, one of them 1",
    source="magnet flux and temperature: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014",
    excited_by="tests in which the two inverters share the torque differently",
    parameters=(
        EffectParameter("gain_m1", "", 1.0, 0.3, 3.0, "true torque of inverter M1 over its reading: g_1", True),
        EffectParameter("gain_m2", "", 1.0, 0.3, 3.0, "true torque of inverter M2 over its reading: g_2", True),
    ),
    either=("gain_m1", "gain_m2"),
    acting=Acting(Place.INVERTER, gain_law),
    structures=EVERY_LINE,
    resembles=("torque_derating", "torque_saturation"),
    scales=lambda _model, _records: (1.0, 1.0),
    starts=lambda _model, _records: [(0.9, Held(1.0)), (Held(1.0), 0.9)],
    testable=gain_testable,
    text=gain_sentence,
    rescaled=gain_rescaled,
    linear=True,
)


# The true torque falls behind its reading as magnets and windings warm.


def warmth(
    torque: FloatArray,
    since_start_s: FloatArray,
    period_s: float,
    begun: float,
    _depth: float,
    time_constant_s: float,
    heating: float,
    warm: float,
) -> FloatArray:
    """Return how warm the windings are when each row begins and after the last, 1 at the full loss; (N + 1,).

    By time alone, or, where they are heated, by the torque's own losses: ``tau dh/dt + h = (T / T_n)^2``, held over
    each period; ``begun`` is the first row's then.
    """
    if heating <= 0.0:
        rows_and_end = np.append(since_start_s, since_start_s[-1] + period_s)
        return np.asarray(1.0 - (1.0 - warm) * np.exp(-rows_and_end / time_constant_s))
    from scipy.signal import lfilter  # half a second that few need

    kept = float(np.exp(-period_s / time_constant_s))
    heat = (1.0 - kept) * (torque / heating) ** 2
    states, _ = lfilter([1.0], [1.0, -kept], heat, zi=[kept * begun])
    return np.concatenate([[begun], states])


def derating_law(
    torque: FloatArray,
    _since_start_s: FloatArray,
    state: FloatArray,
    depth: float,
    _time_constant_s: float,
    _heating: float,
    _warm: float,
) -> FloatArray:
    """Return ``T (1 - d h)``, the torque that acts [Nm]."""
    return np.asarray(torque * (1.0 - depth * state))


def derating_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return 1 for the depth, the longest recording's length, and half of the torque in use, a usual rms of it."""
    return (1.0, longest_s(records), 0.5 * torque_scale(records))


def derating_reparametrised(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[OtherForm]:
    """Return a loss by the torque's own heat, within the recording and beyond it."""
    if values["heating_nm"] > 0.0:
        return []
    return [OtherForm((values["depth"], share, Held(1.0)), {}) for share in (0.3, 2.0)]


def derating_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the depth, the lasting torque it needs, and the time constant."""
    by = "by up to"
    if values["heating_nm"] > 0.0:
        by = f"under a lasting torque of {values['heating_nm']:.3g} {unit('torque', motion)} by"
    return (
        f"the true torque falls {by} {values['depth']:.1%} against its reading, "
        f"with a time constant of {values['time_constant_s']:.3g} s"
    )


def derating_implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a time constant too short for warming."""
    least_s = QUICKEST * derating_scales(model, records)[1]
    if values["time_constant_s"] > least_s:
        return ""
    return f"a loss with a time constant of {values['time_constant_s']:.2g} s is not from warming"


TORQUE_DERATING = Effect(
    name="torque_derating",
    element=Element.TORQUE_PATH,
    title="derating of the torque",
    law="T = T_read (1 - d h), h = 1 - (1 - h_0) exp(-t / tau); by its own heat tau dh/dt + h = (T_read / T_n)^2",
    source="magnet flux and temperature: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014; "
    "heat of a winding: IEC 60255-149",
    excited_by="a long pull at high torque",
    parameters=(
        EffectParameter("depth", "", 0.0, 0.0, 1.0, "share of the torque that is lost in the end: d", most=1.0),
        EffectParameter("time_constant_s", "s", 1.0, 0.02, 10.0, "time constant of the decay: tau"),
        EffectParameter("heating_nm", "torque", 0.0, 0.0, 10.0, "torque that leads to the loss d: T_n", True),
        EffectParameter(
            "warm", "", 0.0, 0.0, 1.0, "share of d as a recording begins: h_0", True, True, most=1, outlasts=True
        ),
    ),
    acting=Acting(Place.TORQUE, derating_law, course=warmth),
    structures=EVERY_LINE,
    resembles=("inverter_gain_mismatch", "road_grade", "warming_friction"),
    scales=derating_scales,
    starts=lambda _model, _records: [(0.2, 0.3, Held(0.0)), (0.3, 2.0, Held(0.0))],
    reparametrised=derating_reparametrised,
    text=derating_sentence,
    implausible=derating_implausible,
    linear=True,
)


# The true torque stops at a limit that its reading passes.


def limited(torque: FloatArray, limit: float, sharpness: float) -> FloatArray:
    """Return a torque that stops at a limit [Nm], at an edge or in a knee: ``T / (1 + |T/L|^n)^(1/n)``."""
    if not np.isfinite(limit):
        return torque
    if sharpness >= EDGE:
        return np.clip(torque, -limit, limit)
    ratio = np.abs(torque) / limit
    small, large = np.minimum(ratio, 1.0), np.maximum(ratio, 1.0)
    size = np.where(
        ratio <= 1.0,
        small / (1.0 + small**sharpness) ** (1.0 / sharpness),
        (1.0 + large**-sharpness) ** (-1.0 / sharpness),
    )
    return np.asarray(np.copysign(limit * size, torque))


def limit_law(
    torque: FloatArray, inverter: int, limit_m1: float, limit_m2: float, _limit_sum: float, sharpness: float
) -> FloatArray:
    """Return the torque of an inverter that acts [Nm]; of a third one its reading."""
    return limited(torque, limit_m1 if inverter == 0 else limit_m2 if inverter == 1 else math.inf, sharpness)


def limit_of_sum(
    torque: FloatArray, _limit_m1: float, _limit_m2: float, limit_sum: float, sharpness: float
) -> FloatArray:
    """Return the torque of all inverters that acts [Nm]."""
    return limited(torque, limit_sum, sharpness)


def saturation_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return the largest torque of one input, twice, of all together, and 1."""
    each = largest_torque(records)
    return (each, each, torque_scale(records), 1.0)


def saturation_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return limits of both inverters, of one of them, and of their sum."""
    off = Held(math.inf)
    return [
        (*limits, 10.0) for x in (0.9, 0.6) for limits in ((x, x, off), (x, off, off), (off, x, off), (off, off, x))
    ]


def saturation_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State each limit that was found."""
    torque = unit("torque", motion)
    found = [
        f"{limit:.3g} {torque} {of}"
        for key, of in (
            ("limit_m1_nm", "in inverter m1"),
            ("limit_m2_nm", "in inverter m2"),
            ("limit_sum_nm", "in sum"),
        )
        if math.isfinite(limit := values[key])
    ]
    return f"the true torque stops at {' and '.join(found)}, whatever its reading"


TORQUE_SATURATION = Effect(
    name="torque_saturation",
    element=Element.TORQUE_PATH,
    title="saturation of the torque",
    law="T = sat(sat(T_M1, L_1) + sat(T_M2, L_2), L), sat(T, L) = T / (1 + |T / L|^n)^(1/n)",
    source="current and voltage limits of an inverter: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque near its limits: tip-in, reversal",
    parameters=(
        EffectParameter("limit_m1_nm", "torque", math.inf, 0.05, 1.2, "limit of inverter M1: L_1", True),
        EffectParameter("limit_m2_nm", "torque", math.inf, 0.05, 1.2, "limit of inverter M2: L_2", True),
        EffectParameter("limit_sum_nm", "torque", math.inf, 0.05, 1.2, "limit of the sum: L", True),
        EffectParameter("sharpness", "", EDGE, 2.0, EDGE, "sharpness of the knee: n", True, form="soft"),
    ),
    either=("limit_m1_nm", "limit_m2_nm", "limit_sum_nm"),
    acting=Acting(Place.INVERTER, limit_law, of_sum=limit_of_sum),
    structures=EVERY_LINE,
    resembles=("inverter_gain_mismatch", "stiffness_nonlinearity"),
    scales=saturation_scales,
    starts=saturation_starts,
    text=saturation_sentence,
    linear=True,
)


# The true torque grows less than its reading: the machine's iron saturates, for both signs alike or not.


def nonlinearity_law(torque: FloatArray, _since_start_s: FloatArray, curvature: float, asymmetry: float) -> FloatArray:
    """Return ``T - q T |T| - e T^2``, the torque that acts [Nm]."""
    return np.asarray(torque - torque * (curvature * np.abs(torque) + asymmetry * torque))


def nonlinearity_scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a tenth of the torque lost at the largest in use."""
    each = 0.1 / torque_scale(records)
    return (each, each)


def nonlinearity_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need torques of different sizes and both signs: one size is a gain."""
    sizes = np.concatenate([np.abs(record.total_torque_nm) for record in records])
    low, high = np.percentile(sizes, [10, 95])
    if high - low > SPREAD * high and any(torque_reverses(record) for record in records):
        return None
    return Untestable("the torque is always of about one size: not separable from a gain", "reversal")


def nonlinearity_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State for how much torque, either way, the reading is off by a hundredth more."""
    loss, tilt = values["curvature_per_nm"], values["asymmetry_per_nm"]

    def off(share_per_torque: float) -> str:
        if share_per_torque == 0.0:
            return "is its reading"
        how = "falls short of" if share_per_torque > 0.0 else "exceeds"
        return f"{how} its reading by 1 % for each {0.01 / abs(share_per_torque):.3g} {unit('torque', motion)}"

    if tilt == 0.0:
        return f"the true torque {off(loss)}"
    return f"the true torque {off(loss + tilt)} where it is positive, and {off(loss - tilt)} where it is negative"


TORQUE_NONLINEARITY = Effect(
    name="torque_nonlinearity",
    element=Element.TORQUE_PATH,
    title="nonlinear torque",
    law="T = T_read - q T_read |T_read| - e T_read^2",
    source="saturation of the iron: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014, ch. 3",
    excited_by="small and large torques of both signs",
    parameters=(
        EffectParameter("curvature_per_nm", "per_torque", 0.0, -6.0, 6.0, "loss per torque, both signs: q"),
        EffectParameter("asymmetry_per_nm", "per_torque", 0.0, -6.0, 6.0, "more for positive torque: e", True),
    ),
    example={"curvature_per_nm": 8e-4, "asymmetry_per_nm": 3e-4},
    either=("curvature_per_nm", "asymmetry_per_nm"),
    acting=Acting(Place.TORQUE, nonlinearity_law),
    structures=EVERY_LINE,
    resembles=("torque_saturation", "inverter_gain_mismatch", "stiffness_nonlinearity"),
    scales=nonlinearity_scales,
    starts=lambda _model, _records: [(0.5, Held(0.0)), (0.3, 0.3)],
    testable=nonlinearity_testable,
    text=nonlinearity_sentence,
    linear=True,
)


# The reading of the torque is off by an offset, from the start on or as it drifts away.


def bias_law(torque: FloatArray, since_start_s: FloatArray, offset: float, time_constant_s: float) -> FloatArray:
    """Return ``T + b (1 - exp(-t / tau))``, the torque that acts [Nm]; ``T + b`` without a time constant."""
    if time_constant_s <= 0.0:
        return np.asarray(torque + offset)
    return np.asarray(torque - offset * np.expm1(-since_start_s / time_constant_s))


def is_load_known(model: Driveline) -> bool:
    """Tell whether the constant load torque is a number that the model gives."""
    return not isinstance(model.load, Load)


def bias_starts(model: Driveline, records: Sequence[Record]) -> list[FitStart]:
    """Return starts that drift, and one that does not where the load is known."""
    drifting: list[FitStart] = [(0.5, 0.3), (1.0, 2.0)]
    return [(0.5, Held(0.0)), *drifting] if is_load_known(model) else drifting


def bias_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a long recording or a known load: a constant bias is a constant load torque."""
    if is_load_known(model) or longest_s(records) >= LEAST_S:
        return None
    reason = f"every recording is shorter than {LEAST_S:g} s and the constant load torque is unknown"
    return Untestable(reason, "cruise", needs="constant in the model file's [load], for an offset that does not drift")


def bias_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the offset, and the time constant where it drifts."""
    side = "above" if values["offset_nm"] > 0.0 else "below"
    offset = f"{abs(values['offset_nm']):.3g} {unit('torque', motion)} {side} its reading"
    if values["time_constant_s"] <= 0.0:
        return f"the true torque is {offset}"
    return f"the true torque drifts to {offset}, with a time constant of {values['time_constant_s']:.3g} s"


TORQUE_BIAS = Effect(
    name="torque_bias",
    element=Element.TORQUE_PATH,
    title="offset of the torque reading",
    law="T = T_read + b; drifting T = T_read + b (1 - exp(-t / tau))",
    source="offset of current sensors and its drift: IEC 60688; Leonhard, Control of Electrical Drives, 3rd ed., 2001",
    excited_by="long recordings, the same course of the load in several",
    parameters=(
        EffectParameter("offset_nm", "torque", 0.0, -20.0, 20.0, "offset: b"),
        EffectParameter("time_constant_s", "s", 0.0, 0.02, 10.0, "time constant of its drift: tau", True),
    ),
    example={"offset_nm": 25.0, "time_constant_s": 4.0},
    acting=Acting(Place.TORQUE, bias_law),
    structures=EVERY_LINE,
    resembles=("road_grade", "warming_friction", "torque_derating"),
    scales=lambda _model, records: (0.02 * torque_scale(records), longest_s(records)),
    starts=bias_starts,
    testable=bias_testable,
    text=bias_sentence,
    linear=True,
)
