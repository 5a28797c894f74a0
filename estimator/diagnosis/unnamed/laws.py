"""The laws that are tried, element by element, as functions of the motion at their place; and shapes to make them of.

A name is a formula, which takes a coefficient, or a phrase, which begins with an article
(`estimator.diagnosis.inference.wording`). Signals have the shape (B,).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.signal import lfilter

from estimator.compiled import compiled
from estimator.diagnosis.line.blocks import Motion
from estimator.physics.effect import Element
from estimator.signals.record import FloatArray

ROUNDED = 0.02  # a sign function changes over this share of its argument's range

KNOTS = 9
"""Of a free function of one signal: between its first and 99th percentile, the same share of samples between two."""


def top_of(values: FloatArray) -> float:
    """Return the top of a signal's size, but for single values."""
    return max(float(np.percentile(np.abs(values), 99)), np.finfo(float).tiny)


def sign(values: FloatArray) -> FloatArray:
    """Return a signal's sign, rounded about zero."""
    width = ROUNDED * top_of(values)
    return np.tanh(values / width)


def inside(values: FloatArray, share: float) -> FloatArray:
    """Return a signal held at a share of its range."""
    limit = share * top_of(values)
    return np.clip(values, -limit, limit)


def beyond(values: FloatArray, share: float) -> FloatArray:
    return values - inside(values, share)


@compiled
def carried(values: FloatArray, width: float) -> FloatArray:
    """Return the deflection of a slider that is moved by a signal, from rest, and yields at a width."""
    found = np.zeros(values.size)
    for k in range(1, values.size):
        found[k] = min(max(found[k - 1] + values[k] - values[k - 1], -width), width)
    return found


def slide(values: FloatArray, share: float) -> FloatArray:
    """Return what a slider carries that yields after a share of a signal's range (Prandtl)."""
    return carried(values, share * top_of(values))


def peaked(speed: FloatArray, share: float) -> FloatArray:
    there = speed / (share * top_of(speed))
    return there / (1.0 + there**2)


def fading(speed: FloatArray, share: float) -> FloatArray:
    return sign(speed) * np.exp(-np.abs(speed) / (share * top_of(speed)))


def behind(values: FloatArray, motion: Motion, time_constant_s: float) -> FloatArray:
    """Return how far a first-order lag of a signal is behind it."""
    period_s = float(motion.time_s[1] - motion.time_s[0])
    keep = np.exp(-period_s / time_constant_s)
    lagged = lfilter([1.0 - keep], [1.0, -keep], values - values[0]) + values[0]
    return lagged - values


def rate(values: FloatArray, motion: Motion) -> FloatArray:
    """Return a signal's change per second."""
    return np.gradient(values, motion.time_s)


def since_start(motion: Motion) -> FloatArray:
    """Return the time since the first block [s]."""
    return motion.time_s - motion.time_s[0]


def decaying(values: FloatArray, motion: Motion, time_s: float) -> FloatArray:
    """Return a signal whose part decays over a time, as oil warms up."""
    return values * np.exp(-since_start(motion) / time_s)


def rising(values: FloatArray, motion: Motion, time_s: float) -> FloatArray:
    """Return a signal whose part sets in over a time."""
    return values - decaying(values, motion, time_s)


def at_low_speed(values: FloatArray, motion: Motion, share: float) -> FloatArray:
    return values / (1.0 + (motion.speed / (share * top_of(motion.speed))) ** 2)


def knots_of(values: FloatArray) -> FloatArray:
    """Return the knots of a free function of a signal, increasing."""
    return np.unique(np.percentile(values, np.linspace(1.0, 99.0, KNOTS)))


def hats(values: FloatArray, knots: FloatArray) -> FloatArray:
    """Return the piecewise linear basis on K knots, shape (N, K); constant beyond the ends."""
    return np.stack([np.interp(values, knots, unit) for unit in np.eye(knots.size)], axis=1)


Law = Callable[[Motion], FloatArray]
"""A function of the motion in one recording, shape (B,)."""


def one(motion: Motion) -> FloatArray:
    """Return what does not change: the law of a plain step or wave."""
    return np.ones_like(motion.angle)


def _torque(motion: Motion) -> FloatArray:
    return motion.torque


def _speed(motion: Motion) -> FloatArray:
    return motion.speed


def _twist(m: Motion) -> FloatArray:
    return m.twist


def _twist_rate(m: Motion) -> FloatArray:
    return m.speed - m.load_speed


def _of(function: Callable[[FloatArray, float], FloatArray], signal: Law, size: float) -> Law:
    return lambda m: function(signal(m), size)


def _with(function: Callable[[FloatArray, Motion, float], FloatArray], signal: Law, time_s: float) -> Law:
    return lambda m: function(signal(m), m, time_s)


def _lags(phrase: str, signal: Law, times_s: Sequence[float]) -> dict[str, Law]:
    """Return how far lags of first order are behind a signal; the time is appended to ``phrase``."""
    return {f"{phrase} {time_s:g} s": _with(behind, signal, time_s) for time_s in times_s}


SHAFT_TORQUE_LAGS = _lags("the shaft torque behind by", _twist, (0.01, 0.03, 0.1))
RELAXATIONS = _lags("a relaxation of the twist in", _twist, (0.005, 0.01, 0.02, 0.04, 0.1, 0.3))
TORQUE_LAGS = _lags("the torque behind by", _torque, (0.005, 0.02, 0.06, 0.2))
READING_LAGS = _lags("the speed reading behind by", _speed, (0.005, 0.02, 0.06, 0.2))

LAGS = frozenset({*SHAFT_TORQUE_LAGS, *RELAXATIONS, *TORQUE_LAGS, *READING_LAGS})
"""Laws that are linear systems with a time of their own."""


def _rate_of(signal: Law, motion: Motion) -> FloatArray:
    return rate(signal(motion), motion)


def _drag_laws(name: str, speed: Law) -> dict[str, Law]:
    """Return what may brake a mass, as functions of its speed and of time, and an inertia that goes with its speed."""
    laws: dict[str, Law] = {
        f"sign({name})": lambda m: sign(speed(m)),
        f"{name} |{name}|": lambda m: speed(m) * np.abs(speed(m)),
        f"{name}^3": lambda m: speed(m) ** 3,
        f"|{name}|": lambda m: np.abs(speed(m)),
        f"d{name}/dt |{name}|": lambda m: rate(speed(m), m) * np.abs(speed(m)),
        f"d{name}/dt {name}^2": lambda m: rate(speed(m), m) * speed(m) ** 2,
    }
    for share in (0.05, 0.15, 0.4):
        laws[f"{name} / (1 + ({name} / {share:g} top)^2)"] = _of(peaked, speed, share)
        laws[f"d{name}/dt / (1 + (w_M / {share:g} top)^2)"] = _with(at_low_speed, partial(_rate_of, speed), share)
        laws[f"sign({name}) exp(-|{name}| / {share:g} top)"] = _of(fading, speed, share)
    for time_s in (3.0, 10.0, 30.0):
        laws[f"{name} exp(-t / {time_s:g} s)"] = _with(decaying, speed, time_s)
    return laws


MOTOR_LAWS: Mapping[str, Law] = _drag_laws("w_M", lambda m: m.speed)

LOAD_LAWS: Mapping[str, Law] = _drag_laws("w_L", lambda m: m.load_speed) | SHAFT_TORQUE_LAGS


def _shaft_laws() -> dict[str, Law]:
    laws: dict[str, Law] = {
        "twist |twist|": lambda m: m.twist * np.abs(m.twist),
        "twist^2": lambda m: m.twist**2,
        "twist^3": lambda m: m.twist**3,
        "sign(twist)": lambda m: sign(m.twist),
        "sign(d twist/dt)": lambda m: sign(_twist_rate(m)),
        "|d twist/dt| d twist/dt": lambda m: np.abs(_twist_rate(m)) * _twist_rate(m),
        "twist^2 d twist/dt": lambda m: m.twist**2 * _twist_rate(m),
        "|twist| d twist/dt": lambda m: np.abs(m.twist) * _twist_rate(m),
        "twist |w_M|": lambda m: m.twist * np.abs(m.speed),
        "twist w_M^2": lambda m: m.twist * m.speed**2,
        "d twist/dt |w_M|": lambda m: _twist_rate(m) * np.abs(m.speed),
        "twist t": lambda m: m.twist * since_start(m),
    }
    for share in (0.03, 0.1, 0.3):
        laws[f"the twist held inside {share:g} of its range"] = _of(inside, _twist, share)
        laws[f"a slider that yields at {share:g} of the twist"] = _of(slide, _twist, share)
        laws[f"twist / (1 + (w_M / {share:g} top)^2)"] = _with(at_low_speed, _twist, share)
    return laws | RELAXATIONS


SHAFT_LAWS: Mapping[str, Law] = _shaft_laws()


def _torque_laws() -> dict[str, Law]:
    laws: dict[str, Law] = {
        "T": lambda m: m.torque,
        "|T|": lambda m: np.abs(m.torque),
        "T |T|": lambda m: m.torque * np.abs(m.torque),
        "T^3": lambda m: m.torque**3,
        "sign(T)": lambda m: sign(m.torque),
        "T t": lambda m: m.torque * since_start(m),
        "a torque one period late": lambda m: np.append(m.torque[:1], m.torque[:-1]) - m.torque,
        "a torque two periods late": lambda m: np.append(m.torque[[0, 0]], m.torque[:-2]) - m.torque,
        "T |w_M|": lambda m: m.torque * np.abs(m.speed),
    }
    for share in (0.03, 0.1):
        laws[f"the torque held inside {share:g} of its range"] = _of(inside, _torque, share)
    for share in (0.5, 0.65, 0.8, 0.9):
        laws[f"the torque beyond {share:g} of its range"] = _of(beyond, _torque, share)
    laws |= TORQUE_LAGS
    for time_s in (3.0, 10.0, 30.0):
        laws[f"T (1 - exp(-t / {time_s:g} s))"] = _with(rising, _torque, time_s)
    return laws


TORQUE_LAWS: Mapping[str, Law] = _torque_laws()


def _reading_laws() -> dict[str, Law]:
    laws: dict[str, Law] = {
        "dw/dt": lambda m: rate(m.speed, m),
        "|w|": lambda m: np.abs(m.speed),
        "w": lambda m: m.speed,
        "w |w|": lambda m: m.speed * np.abs(m.speed),
        "w^3": lambda m: m.speed**3,
        "sign(w)": lambda m: sign(m.speed),
        "T": lambda m: m.torque,
    }
    return laws | READING_LAGS


READING_LAWS: Mapping[str, Law] = _reading_laws()

LAWS: Mapping[Element, Mapping[str, Law]] = {
    Element.TORQUE_PATH: TORQUE_LAWS,
    Element.MOTOR: MOTOR_LAWS,
    Element.SHAFT: SHAFT_LAWS,
    Element.LOAD: LOAD_LAWS,
    Element.SPEED_SENSOR: READING_LAWS,
    Element.ACQUISITION: {"t dw/dt": lambda m: since_start(m) * rate(m.speed, m)},
}

FREE: Mapping[Element, Mapping[str, Law]] = {
    Element.TORQUE_PATH: {"T": lambda m: m.torque},
    Element.MOTOR: {"w_M": lambda m: m.speed},
    Element.SHAFT: {"twist": lambda m: m.twist, "d twist/dt": _twist_rate},
    Element.LOAD: {"w_L": lambda m: m.load_speed},
    Element.SPEED_SENSOR: {"w": lambda m: m.speed},
    Element.ACQUISITION: {},
}
"""Signals of which a law may be any function."""

CHANGING: Mapping[Element, Mapping[str, Law]] = {
    Element.TORQUE_PATH: {},
    Element.MOTOR: {"dw_M/dt": lambda m: rate(m.speed, m)},
    Element.SHAFT: {"twist": lambda m: m.twist},
    Element.LOAD: {"dw_L/dt": lambda m: rate(m.load_speed, m), "sign(w_L)": lambda m: sign(m.load_speed)},
    Element.SPEED_SENSOR: {},
    Element.ACQUISITION: {},
}
"""Laws that may set in at a moment of one recording."""

MODULATIONS: Mapping[Element, Mapping[str, Law]] = {
    Element.TORQUE_PATH: {"": one, " of T": _torque},
    Element.MOTOR: {},  # what depends on the motor's angle is the torque path's there
    Element.SHAFT: {"": one},
    Element.LOAD: {"": one},
    Element.SPEED_SENSOR: {" of w": _speed},
    Element.ACQUISITION: {},
}
"""What a wave over the angle is multiplied by, as it ends the name."""
