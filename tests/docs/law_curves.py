"""The laws of the catalogue as curves, by the kernel's own functions where it has one."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimator.physics.effects.shaft import loading_rate
from estimator.physics.inputs import shaft_torque
from estimator.physics.kernel import conditions, rates, sensing
from estimator.physics.kernel.state_vector import STATES, unpacked
from estimator.physics.layout import flat_values
from estimator.signals.record import FloatArray
from tests.docs.bus import BUS, TIME_S, Values


@dataclass(frozen=True, slots=True)
class Curve:
    """A law, drawn: label of each axis and lines, each a name with x and y."""

    x_label: str
    y_label: str
    lines: tuple[tuple[str, FloatArray, FloatArray], ...]


SPEEDS = np.linspace(-12.0, 12.0, 241)
FAST = np.linspace(0.0, 60.0, 121)
TWISTS = np.linspace(-0.08, 0.08, 241)
TORQUES = np.linspace(-400.0, 400.0, 161)


def friction(name: str) -> Callable[[Values], Curve]:
    """Draw a friction law of the motor over its speed."""

    def curve(values: Values) -> Curve:
        p = flat_values(BUS, {name: values})
        with_it, without = (
            np.array([rates.motor_friction(w, each, 0.05, 1.0) for w in SPEEDS]) for each in (p, flat_values(BUS, {}))
        )
        return Curve("motor speed [rad/s]", "friction [Nm]", (("without", SPEEDS, without), ("with", SPEEDS, with_it)))

    return curve


def drag(name: str, speeds: FloatArray) -> Callable[[Values], Curve]:
    """Draw a drag of the load over its speed."""

    def curve(values: Values) -> Curve:
        lines = []
        for label, effects in (("without", {}), ("with", {name: values})):
            p = flat_values(BUS, effects)
            now = conditions.conditions(2, 0.0, 1e-3, 0.0, 0.0, 0.05, p)
            lines.append((label, speeds, np.array([rates.load_friction(w, w, now, p) for w in speeds])))
        return Curve("load speed [rad/s]", "drag [Nm]", tuple(lines))

    return curve


def shaft(name: str) -> Callable[[Values], Curve]:
    """Draw the shaft's torque over its twist."""

    def curve(values: Values) -> Curve:
        lines = []
        for label, effects in (("without", {}), ("with", {name: values})):
            p = flat_values(BUS, effects)
            now = conditions.conditions(2, 0.0, 1e-3, 0.0, 0.0, 0.05, p)
            line, still = conditions.Line(2, elastic=False, extended=False, own=()), unpacked(np.zeros(STATES))
            torque = np.array([rates.shaft_torque(line, twist, 0.0, now, still, p) for twist in TWISTS])
            lines.append((label, 1e3 * TWISTS, torque))
        return Curve("twist [mrad]", "shaft torque [Nm]", tuple(lines))

    return curve


def hysteresis(values: Values) -> Curve:
    """Draw the loop of torque and twist, first loading left out."""
    phase = np.linspace(0.0, 2.5 * 2.0 * np.pi, 4001)
    twist = 0.03 * np.sin(phase)
    loading = np.zeros_like(twist)
    for i, step in enumerate(np.diff(twist)):
        rate = step / 1e-3
        loading[i + 1] = loading[i] + 1e-3 * loading_rate(loading[i], rate / values["yield_rad"], 1.0, 1.0, 1e9)
    late = phase > np.pi
    torque = BUS["k"] * twist + values["friction_nm"] * loading
    lines = (
        ("without", 1e3 * twist[::40], BUS["k"] * twist[::40]),
        ("with", 1e3 * twist[late][::20], torque[late][::20]),
    )
    return Curve("twist [mrad]", "shaft torque [Nm]", lines)


def torque(name: str) -> Callable[[Values], Curve]:
    """Draw true over read torque, both inverters sharing it."""

    def curve(values: Values) -> Curve:
        each = 0.5 * TORQUES[:, None] * np.ones((1, 2))
        true = shaft_torque(each, np.zeros(TORQUES.size), flat_values(BUS, {name: values}))
        lines = (("without", TORQUES, TORQUES), ("with", TORQUES, true))
        return Curve("torque as read [Nm]", "true torque [Nm]", lines)

    return curve


def step_answer(label: str, answer: Callable[[FloatArray, Values], FloatArray]) -> Callable[[Values], Curve]:
    """Draw the answer to a unit step."""

    def curve(values: Values) -> Curve:
        time_s = np.linspace(-0.02, 0.15, 171)
        step = np.where(time_s >= 0.0, 1.0, 0.0)
        return Curve("time [s]", label, (("without", time_s, step), ("with", time_s, answer(time_s, values))))

    return curve


def lagging(time_s: FloatArray, values: Values) -> FloatArray:
    """Answer with a first-order lag."""
    return np.where(time_s >= 0.0, -np.expm1(-np.maximum(time_s, 0.0) / values["time_constant_s"]), 0.0)


def late(time_s: FloatArray, values: Values) -> FloatArray:
    """Answer after a delay."""
    return np.where(time_s >= values["delay_s"], 1.0, 0.0)


def over_time(label: str, without: float, course: Callable[[Values], FloatArray]) -> Callable[[Values], Curve]:
    """Draw the course of a quantity."""

    def curve(values: Values) -> Curve:
        lines = (("without", TIME_S, np.full(TIME_S.size, without)), ("with", TIME_S, course(values)))
        return Curve("time [s]", label, lines)

    return curve


def during(values: Values) -> FloatArray:
    """Return 1 while an event lasts, else 0."""
    return np.where((TIME_S >= values["from_s"]) & (TIME_S < values["to_s"]), 1.0, 0.0)


def fading(values: Values) -> FloatArray:
    """Return what is left of a decay."""
    return np.exp(-TIME_S / values["time_constant_s"])


def over_turn(
    label: str, size: Callable[[Values, FloatArray], FloatArray], most: float = 2.0
) -> Callable[[Values], Curve]:
    """Draw a law over motor turns."""

    def curve(values: Values) -> Curve:
        turns = np.linspace(0.0, most, 241)
        with_it = size(values, 2.0 * np.pi * turns)
        return Curve("motor turns", label, (("without", turns, 0.0 * turns), ("with", turns, with_it)))

    return curve


def response(values: Values) -> Curve:
    """Draw the frequency response of speed to torque, by impedances."""
    frequency = np.linspace(2.0, 40.0, 381)
    s = 2j * np.pi * frequency
    load = s * BUS["J_L"] + BUS["b_L"]
    spring = BUS["k"] / s + BUS["c"]
    behind = 1.0 / (1.0 / spring + 1.0 / load)
    inertia, natural = values["inertia_kg_m2"], 2.0 * np.pi * values["frequency_hz"]
    branch_spring = inertia * (natural**2 / s + 2.0 * values["damping_ratio"] * natural)
    branch = 1.0 / (1.0 / branch_spring + 1.0 / (s * inertia))
    plain = s * BUS["J_M"] + BUS["b_M"] + behind
    lines = tuple(
        (label, frequency, 20.0 * np.log10(1.0 / np.abs(whole)))
        for label, whole in (("without", plain), ("with", plain + branch))
    )
    return Curve("frequency [Hz]", "speed by torque [dB]", lines)


def slip(values: Values) -> Curve:
    """Draw the slide of a tyre over its torque, at two speeds."""
    traction = np.linspace(-400.0, 400.0, 81)
    return Curve(
        "torque at the tyre [Nm]",
        "slide [rad/s]",
        (
            ("without", traction, 0.0 * traction),
            ("40 rad/s", traction, traction * values["slip_per_nm"] * (40.0 + values["creep_rad_s"])),
            ("5 rad/s", traction, traction * values["slip_per_nm"] * (5.0 + values["creep_rad_s"])),
        ),
    )


def reading(name: str) -> Callable[[Values], Curve]:
    """Draw what the sensor shows over the true speed."""

    def curve(values: Values) -> Curve:
        speeds = np.linspace(-5.0, 5.0, 401)
        p = flat_values(BUS, {name: values})
        read = np.array([sensing.shown(w, 0.0, w, p) for w in speeds])
        return Curve("motor speed [rad/s]", "reading [rad/s]", (("without", speeds, speeds), ("with", speeds, read)))

    return curve
