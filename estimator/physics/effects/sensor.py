"""Errors of the speed reading and of its recording."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimator.compiled import compiled
from estimator.lanes import every, some
from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import (
    EVERY_LINE,
    EVERY_STRUCTURE,
    Acting,
    Effect,
    EffectParameter,
    Element,
    Place,
    Untestable,
)
from estimator.physics.motion import measured_speed, speed_scale
from estimator.signals.record import OutputKind, Record

# The resolver's angle is off once and twice per turn, and with it the speed.


STEEPEST = -0.5
"""A resolver whose error falls by more than this per radian is no resolver; Newton's steps stay finite there."""

STANDSTILL = 0.05  # share of its top speed below which a recording comes to standstill between two samples
LEAST_SHARE = 0.5  # share of the magnitude from which a sensor's own motion has no sign left


@compiled
def quantised_law(reading: float, step: float) -> float:
    """Return the step nearest to a reading [rad/s]."""
    return step * math.floor(reading / step + 0.5) if step > 0.0 else reading


SPEED_QUANTISATION = Effect(
    name="speed_quantisation",
    element=Element.SPEED_SENSOR,
    title="coarse resolution of the speed",
    law="w_read = q round(w / q)",
    source="Widrow, Kollar: Quantization Noise, Cambridge 2008",
    excited_by="a speed that passes many steps",
    parameters=(EffectParameter("step_rad_s", "speed", 0.0, 0.0, float("inf"), "step q"),),
    acting=Acting(Place.SENSOR, quantised_law),
    structures=EVERY_LINE,
    resembles=(),
    text="the speed is read in steps of {step_rad_s:.3g} {unit[speed]}",
    kinds=frozenset({OutputKind.SPEED}),
    recognised=True,
    linear=True,
)


@compiled
def resolver_error(angle: float, once: float, once_phase: float, twice: float, twice_phase: float) -> float:
    """Return how far the read angle is off at a true one [rad]."""
    return once * math.sin(angle + once_phase) + twice * math.sin(2.0 * angle + twice_phase)


@compiled
def resolver_slope(angle: float, once: float, once_phase: float, twice: float, twice_phase: float) -> float:
    """Return the read angle's derivative by the true one: 1 for a resolver without error."""
    value = 1.0
    if some(once != 0.0):
        value += once * math.cos(angle + once_phase)
    if some(twice != 0.0):
        value += 2.0 * twice * math.cos(2.0 * angle + twice_phase)
    return value


@compiled
def true_angle(read: float, once: float, once_phase: float, twice: float, twice_phase: float) -> float:
    """Return the angle at which a resolver reads another [rad]; three of Newton's steps leave less than 1e-9."""
    angle = read
    for _ in range(3):
        off = angle + resolver_error(angle, once, once_phase, twice, twice_phase) - read
        rise = resolver_slope(angle, once, once_phase, twice, twice_phase) - 1.0
        angle -= off / (1.0 + max(rise, STEEPEST))
    return angle


@compiled
def resolver_law(speed: float, angle: float, once: float, twice: float, once_phase: float, twice_phase: float) -> float:
    """Return the speed that the resolver gives [rad/s] where it gives an angle [rad]: a recording knows no other."""
    if every(once == 0.0) and every(twice == 0.0):
        return speed
    true = true_angle(angle, once, once_phase, twice, twice_phase)
    return speed * resolver_slope(true, once, once_phase, twice, twice_phase)


def resolver_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the angle errors once and twice per turn."""
    return (
        f"the resolver's angle is off by {1e3 * values['once_rad']:.3g} mrad once and "
        f"{1e3 * values['twice_rad']:.3g} mrad twice per turn"
    )


RESOLVER_ERROR = Effect(
    name="resolver_error",
    element=Element.SPEED_SENSOR,
    title="angle error of the resolver",
    law="w_read = w_M (1 + e_1 cos(phi_M + alpha_1) + 2 e_2 cos(2 phi_M + alpha_2))",
    source="Hanselman, IEEE Trans. Ind. Electron. 37(6), 1990: offset, amplitude and quadrature errors",
    excited_by="motion at any speed",
    parameters=(
        EffectParameter("once_rad", "rad", 0.0, 0.0, 40.0, "angle error once per turn: e_1", True),
        EffectParameter("twice_rad", "rad", 0.0, 0.0, 40.0, "angle error twice per turn: e_2", True),
        EffectParameter("once_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha_1, of each recording", True, True),
        EffectParameter("twice_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha_2, of each recording", True, True),
    ),
    acting=Acting(Place.RESOLVER, resolver_law),
    structures=EVERY_LINE,
    resembles=("torque_ripple", "cardan_second_order", "speed_sign_blind"),
    kinds=frozenset({OutputKind.SPEED}),
    phases={"once_phase_rad": "once_rad", "twice_phase_rad": "twice_rad"},
    scales=lambda _model, _records: (0.01, 0.01),
    starts=lambda _model, _records: [(0.5, 0.5)],
    text=resolver_sentence,
    linear=True,
)


# The sensor reads the magnitude of the speed.


@compiled
def blind_law(reading: float, share: float) -> float:
    """Return ``(1 - s) y + s |y|`` [rad/s]."""
    return reading + share * (abs(reading) - reading)


def blind_testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a speed near standstill, where the sign could be lost."""
    if any(float(np.nanmin(np.abs(measured_speed(record)))) < STANDSTILL * speed_scale([record]) for record in records):
        return None
    return Untestable("the speed stays clear of standstill: it has no other sign that could be lost", "reversal")


def blind_implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a sensor that tells the sign of most of the speed: what differs with the sign is something else."""
    if values["share"] >= LEAST_SHARE:
        return ""
    return f"a sensor that reads {values['share']:.2g} of the speed without its sign is not blind for it"


SPEED_SIGN_BLIND = Effect(
    name="speed_sign_blind",
    element=Element.SPEED_SENSOR,
    title="sensor blind for the sign",
    law="y = (1 - s) w_M + s |w_M|",
    source="pick-up with a single track: Fraden, Handbook of Modern Sensors, 5th ed., Springer 2016",
    excited_by="speed that changes sign: reversal",
    parameters=(EffectParameter("share", "", 0.0, 0.0, 1.0, "share of the magnitude: s", most=1.0),),
    acting=Acting(Place.SENSOR, blind_law),
    structures=EVERY_LINE,
    resembles=("resolver_error",),
    kinds=frozenset({OutputKind.SPEED}),
    scales=lambda _model, _records: (1.0,),
    starts=lambda _model, _records: [(0.9,)],
    testable=blind_testable,
    text="the sensor reads the magnitude of the speed (share {share:.2g})",
    implausible=blind_implausible,
    linear=True,
)


# Speed quantisation: the speed is read in steps that are not small against its noise.
#
# It is recognised in the raw recordings (``diagnosis.acquisition``) and compensated there; no fit releases it.


# Stale samples: a reading that was not renewed in time, and repeats the one before without a flag.
#
# It is recognised in the raw recordings (``diagnosis.acquisition``) and compensated there; no fit releases it.


def stale_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the share of repeated samples."""
    return f"{100.0 * values['share']:.3g}% of the samples are stale: they repeat the value before without a flag"


STALE_SAMPLES = Effect(
    name="stale_samples",
    element=Element.ACQUISITION,
    title="stale samples",
    law="x_read[k] = x_read[k-1] in a share of the rows",
    source="asynchronous process data: CiA 301, synchronous and event-driven PDO; sample-and-hold with missed updates",
    excited_by="speed and torque that change from row to row: PRBS",
    parameters=(EffectParameter("share", "", 0.0, 0.0, 1.0, "share of stale rows", most=1.0),),
    structures=EVERY_STRUCTURE,
    resembles=("transport_delay",),
    text=stale_sentence,
    recognised=True,
)


# Lost samples: readings that are missing, flagged, or recorded as zero.
#
# It is recognised in the raw recordings (``diagnosis.acquisition``) and compensated there; no fit releases it.


def lost_sentence(values: Mapping[str, float], motion: Motion) -> str:
    """State the share of lost samples."""
    return f"{100.0 * values['share']:.3g}% of the samples were lost: missing, flagged or recorded as zero"


LOST_SAMPLES = Effect(
    name="lost_samples",
    element=Element.ACQUISITION,
    title="lost samples",
    law="x_read[k] = NaN, flagged, or 0 in a share of the rows",
    source="missed SYNC or PDO time-out: CiA 301, communication objects",
    excited_by="nothing: it shows in any recording",
    parameters=(EffectParameter("share", "", 0.0, 0.0, 1.0, "share of lost rows", most=1.0),),
    structures=EVERY_STRUCTURE,
    resembles=(),
    text=lost_sentence,
    recognised=True,
)


# Sample jitter: readings taken off their time by a random amount.
#
# It is recognised in the raw recordings (``diagnosis.acquisition``) and compensated there; no fit releases it.


SAMPLE_JITTER = Effect(
    name="sample_jitter",
    element=Element.ACQUISITION,
    title="jitter of the sampling instants",
    law="y_read[k] = y(t_k + tau_k), tau_k independent, rms sigma_t",
    source="Balakrishnan: On the problem of time jitter in sampling, IRE Trans. Inf. Theory 8(3), 1962",
    excited_by="a speed that changes fast: PRBS near the resonance",
    parameters=(EffectParameter("jitter_s", "s", 0.0, 0.0, 1.0, "rms of the time off"),),
    structures=EVERY_STRUCTURE,
    resembles=("clock_drift",),
    scales=lambda _model, records: (min(record.sample_time_s for record in records),),
    text="the sampling instants jitter by {jitter_ms:.3g} ms (rms)",
    recognised=True,
)
