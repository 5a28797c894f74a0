"""Worlds in other forms: laws of a line as others write them, to calibrate a verdict on some and to judge it on others.

Friction that is regularised or has a memory, a gap with its damper in other places, drag with another exponent, soft
saturation, a lag of second order, a shaft with a stop or a slider. Nothing of ``estimator`` is read here: a form is
written from the literature, not from the law that is fitted. Bus, nominal model and tests are the proof's.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numba
import numpy as np

from hil.proof.truth.bus import PERIOD_S, Bus, Test, draw_bus, draw_nominal, draw_plan, sample_times_s
from hil.proof.truth.case import TESTS, Case, TruthRecording
from hil.proof.truth.hidden import log_uniform
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.recording import speed_reading, torque_reading
from hil.proof.truth.specimen import NOTHING, Specimen, Stream, stream

STEPS = 100
"""Steps of a period: 0.1 ms, short against the fastest rate of a law here (800 1/s)."""

SETTLING_S = 3.0
FORM_STREAM = 7
"""Purpose of a generator, next to those of `Stream`."""


class Role(Enum):
    """What a form of world is for: thresholds may be fitted on the first, and are judged on the second."""

    CALIBRATE = "calibrate"
    JUDGE = "judge"


class Line(NamedTuple):
    """A line with its laws in a form; each law is absent at its default."""

    J_M: float
    J_L: float
    k: float
    c: float
    b_M: float
    b_L: float
    load_nm: float
    dry_nm: float = 0.0
    dry_at_load: bool = False
    dry_width: float = 1.0
    dry_excess: float = 0.0
    dry_speed_rad_s: float = 1.0
    memory: int = 0
    gap_rad: float = 0.0
    gap_damper: int = 0
    drag: float = 0.0
    exponent: float = 2.0
    drag_at_load: bool = True
    limit_nm: float = 0.0
    knee: float = 0.0
    lag_s: float = 0.0
    second: float = 0.0
    stop_rad: float = 0.0
    stop_stiffness: float = 0.0
    slider_share: float = 0.0
    slider_rad: float = 1.0
    slider_sharpness: float = 0.0


@numba.njit(cache=True)
def _bristle(p: Line, z: float, speed: float, h: float) -> float:
    """Return the deflection over its limit after a step at constant speed; exact."""
    travel = abs(speed) * h / p.dry_width
    side = math.copysign(1.0, speed)
    if p.memory == 1:
        return side + (z - side) * math.exp(-travel)
    left = 1.0 - side * z
    return side * (1.0 - left / (1.0 + travel * left))


@numba.njit(cache=True)
def _friction(p: Line, z: float, speed: float) -> float:
    size = p.dry_nm * (1.0 + p.dry_excess * math.exp(-abs(speed) / p.dry_speed_rad_s))
    return size * (math.tanh(speed / p.dry_width) if p.memory == 0 else z)


@numba.njit(cache=True)
def _shaft(p: Line, twist: float, rate: float, slider: float) -> float:
    depth = twist
    if p.gap_rad > 0.0:
        depth = math.copysign(max(0.0, abs(twist) - 0.5 * p.gap_rad), twist)
    damped = p.c * rate
    if p.gap_rad > 0.0 and p.gap_damper == 1 and depth == 0.0:
        damped = 0.0
    if p.gap_rad > 0.0 and p.gap_damper == 2:
        damped = p.c * rate * min(1.0, abs(depth) / (0.25 * p.gap_rad))
    torque = p.k * (1.0 - p.slider_share) * depth + p.k * p.slider_share * slider + damped
    if p.stop_rad > 0.0 and abs(depth) > p.stop_rad:
        torque += p.stop_stiffness * p.k * (depth - math.copysign(p.stop_rad, depth))
    return torque


@numba.njit(cache=True)
def _given(p: Line, torque_nm: float) -> float:
    if p.limit_nm <= 0.0:
        return torque_nm
    over = abs(torque_nm) / p.limit_nm
    if p.knee == 0.0:
        return p.limit_nm * math.tanh(torque_nm / p.limit_nm)
    return torque_nm / (1.0 + over**p.knee) ** (1.0 / p.knee)


@numba.njit(cache=True)
def _accelerations(
    p: Line, twist: float, motor: float, load: float, z: float, slider: float, torque_nm: float
) -> tuple[float, float]:
    through = _shaft(p, twist, motor - load, slider)
    on_motor, on_load = torque_nm - p.b_M * motor - through, through - p.b_L * load - p.load_nm
    speed = load if p.drag_at_load else motor
    dragged = p.drag * math.copysign(abs(speed) ** p.exponent, speed)
    rubbed = _friction(p, z, load if p.dry_at_load else motor)
    if p.drag_at_load:
        on_load -= dragged
    else:
        on_motor -= dragged
    if p.dry_at_load:
        on_load -= rubbed
    else:
        on_motor -= rubbed
    return on_motor / p.J_M, on_load / p.J_L


@numba.njit(cache=True)
def _slid(p: Line, slider: float, change: float) -> float:
    """Return the deflection of the slider after a change of the twist."""
    if p.slider_sharpness == 0.0:
        return min(p.slider_rad, max(-p.slider_rad, slider + change))
    over = abs(slider / p.slider_rad) ** p.slider_sharpness
    return slider + change * (1.0 - (over if slider * change > 0.0 else 0.0))


@numba.njit(cache=True)
def _lagged(p: Line, first: float, second: float, torque_nm: float, h: float) -> tuple[float, float]:
    """Return the states of the lag after a step: what comes out is the first."""
    if p.lag_s <= 0.0:
        return torque_nm, 0.0
    if p.second < 0.0:
        rate = second + h * ((torque_nm - first) / p.lag_s + 2.0 * p.second * second) / p.lag_s
        return first + h * rate, rate
    slow = second + (torque_nm - second) * -math.expm1(-h / p.lag_s)
    fast = p.second * p.lag_s
    return (slow if fast == 0.0 else first + (slow - first) * -math.expm1(-h / fast)), slow


@numba.njit(cache=True)
def drive(p: Line, start_rad_s: float, torque_nm: FloatArray) -> FloatArray:
    """Return the motor's speed at the begin of each period of constant torque, shape (N,)."""
    h = 0.01 / STEPS
    speeds = np.empty(torque_nm.size)
    twist, motor, load = 0.0, start_rad_s, start_rad_s
    z, slider, out, state = 0.0, 0.0, _given(p, torque_nm[0]), 0.0
    if p.second >= 0.0:
        state = out
    for row in range(torque_nm.size):
        speeds[row] = motor
        wanted = _given(p, torque_nm[row])
        for _ in range(STEPS):
            out, state = _lagged(p, out, state, wanted, h)
            if p.memory > 0:
                z = _bristle(p, z, load if p.dry_at_load else motor, h)
            of_motor, of_load = _accelerations(p, twist, motor, load, z, slider, out)
            half = 0.5 * h
            middle = (twist + half * (motor - load), motor + half * of_motor, load + half * of_load)
            of_motor, of_load = _accelerations(p, middle[0], middle[1], middle[2], z, slider, out)
            change = h * (middle[1] - middle[2])
            if p.slider_share > 0.0:
                slider = _slid(p, slider, change)
            twist, motor, load = twist + change, motor + h * of_motor, load + h * of_load
    return speeds


Draw = Callable[[np.random.Generator, Bus, int], tuple[str, Mapping[str, float]]]
"""Generator, bus and number of the seed to the effect that is hidden and the fields of `Line` that make it."""


def _places(*names: str) -> Callable[[int], str]:
    return lambda seed: names[seed % len(names)]


_DRY = _places("coulomb_friction_motor", "coulomb_friction_load")
_DRAG = _places("aerodynamic_drag", "quadratic_friction")


def _dry(memory: int, low: float, high: float) -> Draw:
    def draw(rng: np.random.Generator, bus: Bus, seed: int) -> tuple[str, Mapping[str, float]]:
        sizes = {"dry_nm": log_uniform(rng, 8.0, 40.0), "dry_width": log_uniform(rng, low, high), "memory": memory}
        return _DRY(seed), {**sizes, "dry_at_load": _DRY(seed).endswith("load")}

    return draw


def _stribeck(rng: np.random.Generator, bus: Bus, seed: int) -> tuple[str, Mapping[str, float]]:
    return "stribeck_friction", {
        "dry_nm": log_uniform(rng, 8.0, 25.0),
        "dry_width": log_uniform(rng, 5e-4, 5e-3),
        "memory": 1,
        "dry_excess": rng.uniform(0.8, 2.0),
        "dry_speed_rad_s": log_uniform(rng, 0.8, 4.0),
    }


def _gap(damper: int) -> Draw:
    return lambda rng, bus, seed: ("backlash", {"gap_rad": log_uniform(rng, 0.004, 0.04), "gap_damper": damper})


def _drag(low: float, high: float) -> Draw:
    def draw(rng: np.random.Generator, bus: Bus, seed: int) -> tuple[str, Mapping[str, float]]:
        exponent = rng.uniform(low, high)
        size = log_uniform(rng, 0.02, 0.08) * 60.0 ** (2.0 - exponent)  # the same torque at 60 rad/s
        return _DRAG(seed), {"drag": size, "exponent": exponent, "drag_at_load": _DRAG(seed) == "aerodynamic_drag"}

    return draw


def _saturation(knee: tuple[float, float]) -> Draw:
    return lambda rng, bus, seed: (
        "torque_saturation",
        {"limit_nm": log_uniform(rng, 300.0, 480.0), "knee": rng.uniform(*knee)},
    )


def _lag(second: tuple[float, float]) -> Draw:
    return lambda rng, bus, seed: (
        "actuator_lag",
        {"lag_s": log_uniform(rng, 0.004, 0.02), "second": rng.uniform(*second)},
    )


def _stop(rng: np.random.Generator, bus: Bus, seed: int) -> tuple[str, Mapping[str, float]]:
    return "stiffness_nonlinearity", {"stop_rad": rng.uniform(0.02, 0.05), "stop_stiffness": log_uniform(rng, 0.3, 2.0)}


def _slider(sharpness: float) -> Draw:
    def draw(rng: np.random.Generator, bus: Bus, seed: int) -> tuple[str, Mapping[str, float]]:
        sizes = {"slider_share": log_uniform(rng, 0.05, 0.25), "slider_rad": log_uniform(rng, 0.01, 0.04)}
        return "shaft_hysteresis", {**sizes, "slider_sharpness": sharpness}

    return draw


def _nothing(rng: np.random.Generator, bus: Bus, seed: int) -> tuple[str, Mapping[str, float]]:
    return NOTHING, {}


@dataclass(frozen=True, slots=True)
class Form:
    """A form of world: what it is for, and the draw of what it hides."""

    role: Role
    draw: Draw


FORMS: Mapping[str, Form] = {
    "linear": Form(Role.CALIBRATE, _nothing),
    "friction_regularised": Form(Role.CALIBRATE, _dry(0, 0.05, 1.0)),  # tanh of the speed
    "friction_dahl": Form(Role.CALIBRATE, _dry(2, 5e-4, 5e-3)),
    "friction_lugre": Form(Role.JUDGE, _dry(1, 5e-4, 2e-2)),
    "friction_stribeck": Form(Role.JUDGE, _stribeck),  # exponential in the speed, not in its square
    "gap_contact": Form(Role.CALIBRATE, _gap(1)),
    "gap_across": Form(Role.JUDGE, _gap(0)),
    "gap_depth": Form(Role.JUDGE, _gap(2)),
    "drag_low": Form(Role.CALIBRATE, _drag(1.6, 1.9)),
    "drag_high": Form(Role.JUDGE, _drag(2.05, 2.4)),
    "saturation_tanh": Form(Role.CALIBRATE, _saturation((0.0, 0.0))),
    "saturation_knee": Form(Role.JUDGE, _saturation((2.0, 5.0))),
    "lag_two_poles": Form(Role.CALIBRATE, _lag((0.1, 0.6))),
    "lag_second_order": Form(Role.JUDGE, _lag((-1.0, -0.6))),
    "shaft_slider": Form(Role.CALIBRATE, _slider(0.0)),
    "shaft_bouc_wen": Form(Role.JUDGE, _slider(2.0)),
    "shaft_stop": Form(Role.JUDGE, _stop),
}


def make_form(name: str, seed: int) -> Case:
    """Draw a bus with a law in a form, record its three tests, and return them as a case without fresh recordings."""
    bus = draw_bus(stream(seed, Stream.BUS))
    rng = np.random.default_rng([seed, FORM_STREAM, list(FORMS).index(name)])
    effect, sizes = FORMS[name].draw(rng, bus, seed)
    line = Line(bus.J_M, bus.J_L, bus.k, bus.c, bus.b_M, bus.b_L, bus.load_torque_nm)._replace(**sizes)
    nominal = draw_nominal(bus, stream(seed, Stream.NOMINAL))
    specimen = Specimen(effect, seed, bus, nominal, {effect: sizes})
    recordings = (record(seed, test, line, lambda start, torque_nm: drive(line, start, torque_nm)) for test in TESTS)
    return Case(specimen, tuple(recordings), ())


def record(seed: int, test: Test, line: Line, driven: Callable[[float, FloatArray], FloatArray]) -> TruthRecording:
    """Let a line settle at a speed that its torque holds, drive one test, and read it as a recorder does."""
    rng = stream(seed, Stream.RECORDING, TESTS.index(test))
    plan = draw_plan(test, rng)
    held_nm, settled = holding_nm(line, plan.speed_rad_s), round(SETTLING_S / PERIOD_S)
    torque_nm = held_nm + plan.torque_nm
    speed = driven(plan.speed_rad_s, np.concatenate([np.full(settled, held_nm), torque_nm]))[settled:]
    m1 = plan.share_m1 * torque_nm
    return TruthRecording(
        time_s=sample_times_s(),
        torque_ref_nm=torque_nm,
        torque_m1_nm=torque_reading(m1, rng),
        torque_m2_nm=torque_reading(torque_nm - m1, rng),
        speed_rad_s=speed_reading(speed, rng),
        speed_true_rad_s=speed,
        disturbance_nm=np.zeros(0),
    )


def holding_nm(line: Line, speed_rad_s: float) -> float:
    """Return the torque that holds a speed; at standstill the constant load alone."""
    rubbed = line.dry_nm if speed_rad_s else 0.0
    return line.load_nm + (line.b_M + line.b_L) * speed_rad_s + line.drag * speed_rad_s**line.exponent + rubbed
