"""Candidates for a law without a name: functions of what happens in the line, at every place of the chain.

A law acts as a torque at motor, shaft or load, in the torque path, or as an error of the reading. Each is a function of
the motion that goes with an unknown input at its own place (``estimator.diagnosis.equivalent``), so that it is taken at
the speed and the twist that were there and not at those of a simulation that lacks it. The answer of the output to it
is that of the linearised line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.signal import lfilter

from estimator.diagnosis.blocks import Line, Motion, lines
from estimator.diagnosis.equivalent import FORCES, Explanation, Place, explain_all
from estimator.diagnosis.orders import peaks
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.signals.record import FloatArray, OutputKind

STEP_EVERY_S = 0.5
"""Grid of the moments at which a load torque may step."""

CHANGE_EVERY_S = 1.0
"""Grid of the moments at which an inertia, a stiffness or a drag may change."""

MOST_MOMENTS = 60
"""Moments in one recording; a longer one has a coarser grid."""

USUAL_ORDERS = (1.0, 2.0)
"""Waves per motor turn that are tried in any case: imbalance, and joints at an angle."""

COURSE_KNOTS = 11
"""Of a slow course of the load over one recording."""

ROUNDED = 0.02
"""A sign function changes over this share of its argument's range."""

KNOTS = 9
"""Of a free function of one signal: between its first and 99th percentile, the same share of samples between two."""

PLACES = {
    Element.TORQUE_PATH: Place.MOTOR,
    Element.MOTOR: Place.MOTOR,
    Element.SHAFT: Place.SHAFT,
    Element.LOAD: Place.LOAD,
    Element.SPEED_SENSOR: Place.SENSOR,
    Element.ACQUISITION: Place.SENSOR,
}
"""Where a law of an element acts."""

DRIVES = {Element.TORQUE_PATH: 1.0, Element.MOTOR: -1.0, Element.SHAFT: 1.0, Element.LOAD: 1.0}
"""Sign of a law at its place: the torque path drives the motor, friction at the motor brakes it."""

Columns = FloatArray
"""One or several functions of time of one recording, shape (B, q)."""

Law = Callable[[Motion], FloatArray]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A law without a name: q functions with a coefficient each, and the output's answers to them.

    Attributes
    ----------
    law : str
        The function, as text.
    answers : ndarray, shape (rows, q)
        Change of the output per unit of each coefficient, over the blocks in use of all recordings.
    """

    element: Element
    law: str
    answers: FloatArray


@dataclass(frozen=True, slots=True)
class Scene:
    """A fit in blocks, with the input that explains its error at every place."""

    result: FitResult
    cut: tuple[Line, ...]
    explanations: Mapping[Place, Explanation]

    def motions(self, element: Element) -> list[Motion]:
        """Return what happens in each recording: when its output is read, or between, where torques act."""
        at_reading = PLACES[element] is Place.SENSOR
        return [line.reading if at_reading else line.motion for line in self.cut]


def scene(result: FitResult, floor: float) -> Scene:
    """Look at the error of a fit from every place."""
    cut = lines(result)
    return Scene(result, cut, explain_all(result, cut, floor))


def _sign(values: FloatArray) -> FloatArray:
    width = ROUNDED * max(float(np.percentile(np.abs(values), 99)), np.finfo(float).tiny)
    rounded: FloatArray = np.tanh(values / width)
    return rounded


def _rate(values: FloatArray, motion: Motion) -> FloatArray:
    slope: FloatArray = np.gradient(values, motion.time_s)
    return slope


def _since_start(motion: Motion) -> FloatArray:
    since: FloatArray = motion.time_s - motion.time_s[0]
    return since


def _late(values: FloatArray, motion: Motion, time_constant_s: float) -> FloatArray:
    """Return how far a first-order lag of a signal is behind it."""
    period_s = float(motion.time_s[1] - motion.time_s[0])
    keep = np.exp(-period_s / time_constant_s)
    lagged = lfilter([1.0 - keep], [1.0, -keep], values - values[0]) + values[0]
    behind: FloatArray = lagged - values
    return behind


def _slide(values: FloatArray, share: float) -> FloatArray:
    """Return what a slider carries that yields after a share of a signal's range (Prandtl)."""
    width = share * _range(values)
    carried = np.empty_like(values)
    carried[0] = load = 0.0
    for k, step in enumerate(np.diff(values), start=1):
        load = min(max(load + step, -width), width)
        carried[k] = load
    return carried


def _range(values: FloatArray) -> float:
    return max(float(np.percentile(np.abs(values), 99)), np.finfo(float).tiny)


def _inside(values: FloatArray, share: float) -> FloatArray:
    """Return a signal held at a share of its range."""
    limit = share * _range(values)
    held: FloatArray = np.clip(values, -limit, limit)
    return held


def _beyond(values: FloatArray, share: float) -> FloatArray:
    """Return what a signal is beyond a share of its range."""
    beyond: FloatArray = values - _inside(values, share)
    return beyond


def _one(motion: Motion) -> FloatArray:
    return np.ones_like(motion.angle)


def _speed(motion: Motion) -> FloatArray:
    return motion.speed


def _torque(motion: Motion) -> FloatArray:
    return motion.torque


def _peaked(speed: FloatArray, share: float) -> FloatArray:
    """Return a drag that is greatest at a share of the top speed, as of eddy currents."""
    there = speed / (share * _range(speed))
    drag: FloatArray = there / (1.0 + there**2)
    return drag


def _fading(speed: FloatArray, share: float) -> FloatArray:
    """Return a friction that fades away over a share of the top speed (Stribeck)."""
    friction: FloatArray = _sign(speed) * np.exp(-np.abs(speed) / (share * _range(speed)))
    return friction


def _decaying(values: FloatArray, motion: Motion, time_s: float) -> FloatArray:
    """Return a signal whose part decays over a time, as oil warms up."""
    part: FloatArray = values * np.exp(-_since_start(motion) / time_s)
    return part


def _rising(values: FloatArray, motion: Motion, time_s: float) -> FloatArray:
    """Return a signal whose part sets in over a time."""
    return values - _decaying(values, motion, time_s)


def _of(function: Callable[[FloatArray, float], FloatArray], signal: Law, size: float) -> Law:
    """Return a function with one size of a signal."""
    return lambda m: function(signal(m), size)


def _with(function: Callable[[FloatArray, Motion, float], FloatArray], signal: Law, time_s: float) -> Law:
    """Return a function with one time of a signal and of its course."""
    return lambda m: function(signal(m), m, time_s)


def _drag_laws(name: str, speed: Law) -> dict[str, Law]:
    """Return what may brake a mass, as functions of its speed and of time."""
    laws: dict[str, Law] = {
        f"sign({name})": lambda m: _sign(speed(m)),
        f"{name} |{name}|": lambda m: speed(m) * np.abs(speed(m)),
        f"{name}^3": lambda m: speed(m) ** 3,
        f"|{name}|": lambda m: np.abs(speed(m)),
    }
    for share in (0.05, 0.15, 0.4):
        laws[f"{name} / (1 + ({name} / {share:g} top)^2)"] = _of(_peaked, speed, share)
        laws[f"sign({name}) exp(-|{name}| / {share:g} top)"] = _of(_fading, speed, share)
    for time_s in (3.0, 10.0, 30.0):
        laws[f"{name} exp(-t / {time_s:g} s)"] = _with(_decaying, speed, time_s)
    return laws


MOTOR_LAWS: Mapping[str, Law] = _drag_laws("w_M", lambda m: m.speed)

LOAD_LAWS: Mapping[str, Law] = _drag_laws("w_L", lambda m: m.load_speed) | {
    f"shaft torque behind by {time_s:g} s": _with(_late, lambda m: m.twist, time_s) for time_s in (0.01, 0.03, 0.1)
}


def _twist(m: Motion) -> FloatArray:
    return m.twist


def _at_low_speed(values: FloatArray, motion: Motion, share: float) -> FloatArray:
    """Return a signal that fades with the speed, over a share of its top."""
    faded: FloatArray = values / (1.0 + (motion.speed / (share * _range(motion.speed))) ** 2)
    return faded


def _twist_rate(m: Motion) -> FloatArray:
    rate: FloatArray = m.speed - m.load_speed
    return rate


def _shaft_laws() -> dict[str, Law]:
    laws: dict[str, Law] = {
        "twist |twist|": lambda m: m.twist * np.abs(m.twist),
        "twist^2": lambda m: m.twist**2,
        "twist^3": lambda m: m.twist**3,
        "sign(twist)": lambda m: _sign(m.twist),
        "sign(d twist/dt)": lambda m: _sign(_twist_rate(m)),
        "|d twist/dt| d twist/dt": lambda m: np.abs(_twist_rate(m)) * _twist_rate(m),
        "twist^2 d twist/dt": lambda m: m.twist**2 * _twist_rate(m),
        "|twist| d twist/dt": lambda m: np.abs(m.twist) * _twist_rate(m),
        "twist |w_M|": lambda m: m.twist * np.abs(m.speed),
        "twist w_M^2": lambda m: m.twist * m.speed**2,
        "d twist/dt |w_M|": lambda m: _twist_rate(m) * np.abs(m.speed),
        "twist t": lambda m: m.twist * _since_start(m),
    }
    for share in (0.03, 0.1, 0.3):
        laws[f"twist held inside {share:g} of its range"] = _of(_inside, _twist, share)
        laws[f"slider that yields at {share:g} of the twist"] = _of(_slide, _twist, share)
        laws[f"twist / (1 + (w_M / {share:g} top)^2)"] = _with(_at_low_speed, _twist, share)
    for time_s in (0.005, 0.01, 0.02, 0.04, 0.1, 0.3):
        laws[f"relaxation of the twist in {time_s:g} s"] = _with(_late, _twist, time_s)
    return laws


SHAFT_LAWS: Mapping[str, Law] = _shaft_laws()


def _torque_laws() -> dict[str, Law]:
    laws: dict[str, Law] = {
        "T": lambda m: m.torque,
        "|T|": lambda m: np.abs(m.torque),
        "T |T|": lambda m: m.torque * np.abs(m.torque),
        "T^3": lambda m: m.torque**3,
        "sign(T)": lambda m: _sign(m.torque),
        "T t": lambda m: m.torque * _since_start(m),
        "one period late": lambda m: np.append(m.torque[:1], m.torque[:-1]) - m.torque,
        "two periods late": lambda m: np.append(m.torque[[0, 0]], m.torque[:-2]) - m.torque,
        "T |w_M|": lambda m: m.torque * np.abs(m.speed),
    }
    for share in (0.03, 0.1):
        laws[f"T held inside {share:g} of its range"] = _of(_inside, _torque, share)
    for share in (0.5, 0.65, 0.8, 0.9):
        laws[f"T beyond {share:g} of its range"] = _of(_beyond, _torque, share)
    for time_s in (0.005, 0.02, 0.06, 0.2):
        laws[f"T behind by {time_s:g} s"] = _with(_late, _torque, time_s)
    for time_s in (3.0, 10.0, 30.0):
        laws[f"T (1 - exp(-t / {time_s:g} s))"] = _with(_rising, _torque, time_s)
    return laws


TORQUE_LAWS: Mapping[str, Law] = _torque_laws()


def _reading_laws() -> dict[str, Law]:
    laws: dict[str, Law] = {
        "dw/dt": lambda m: _rate(m.speed, m),
        "|w|": lambda m: np.abs(m.speed),
        "w": lambda m: m.speed,
        "w |w|": lambda m: m.speed * np.abs(m.speed),
        "w^3": lambda m: m.speed**3,
        "sign(w)": lambda m: _sign(m.speed),
        "T": lambda m: m.torque,
    }
    for time_s in (0.005, 0.02, 0.06, 0.2):
        laws[f"w behind by {time_s:g} s"] = _with(_late, _speed, time_s)
    return laws


READING_LAWS: Mapping[str, Law] = _reading_laws()

LAWS: Mapping[Element, Mapping[str, Law]] = {
    Element.TORQUE_PATH: TORQUE_LAWS,
    Element.MOTOR: MOTOR_LAWS,
    Element.SHAFT: SHAFT_LAWS,
    Element.LOAD: LOAD_LAWS,
    Element.SPEED_SENSOR: READING_LAWS,
    Element.ACQUISITION: {"t dw/dt": lambda m: _since_start(m) * _rate(m.speed, m)},
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
    Element.MOTOR: {"dw_M/dt": lambda m: _rate(m.speed, m)},
    Element.SHAFT: {"twist": lambda m: m.twist},
    Element.LOAD: {"dw_L/dt": lambda m: _rate(m.load_speed, m), "sign(w_L)": lambda m: _sign(m.load_speed)},
    Element.SPEED_SENSOR: {},
    Element.ACQUISITION: {},
}
"""Laws that may set in at a moment of one recording."""


def elements(result: FitResult) -> tuple[Element, ...]:
    """Return the elements at which laws are tried on a fit."""
    if result.problem.grid.structure is Structure.JOINT:
        return (Element.SHAFT,)
    found = [Element.TORQUE_PATH, Element.MOTOR]
    if result.problem.grid.structure is not Structure.ONE_MASS:
        found += [Element.SHAFT, Element.LOAD]
    if result.problem.records[0].kind is OutputKind.SPEED:
        found += [Element.SPEED_SENSOR, Element.ACQUISITION]
    return tuple(found)


Build = Callable[[Sequence[Motion]], list[Columns]]


@dataclass(frozen=True, slots=True)
class Form:
    """The form of a law without a name: from the motion of each recording to its q functions of time."""

    law: str
    build: Build


def forms(view: Scene, element: Element) -> list[Form]:
    """Return every law without a name that is tried at one element."""
    motions = view.motions(element)
    return [
        *_fixed(element),
        *_free(element, motions),
        *_shares(element, motions),
        *_periodic(view, element, motions),
        *_changes(element, motions),
        *_steps(view.result, element, motions),
    ]


def candidates(view: Scene, element: Element, tried: Sequence[Form] | None = None) -> list[Candidate]:
    """Return laws without a name at one element, all by default, with the output's answers to them."""
    return [
        Candidate(element, form.law, answers(view, element, form.build(view.motions(element))))
        for form in (forms(view, element) if tried is None else tried)
    ]


def answers(view: Scene, element: Element, columns: Sequence[Columns]) -> FloatArray:
    """Return the output's answers to functions of time at an element, shape (rows, q), blocks in use only."""
    return np.concatenate(
        [_answers_of(line, element, each)[line.rows] for line, each in zip(view.cut, columns, strict=True)]
    )


def _answers_of(line: Line, element: Element, columns: Columns) -> FloatArray:
    if PLACES[element] is Place.SENSOR:
        return columns
    motor, load = FORCES[PLACES[element]]
    sign = DRIVES[element]
    found = np.zeros_like(columns)
    for i, column in enumerate(columns.T):
        if column.any():
            forced = np.ascontiguousarray(sign * column)
            found[:, i] = line.tangent.answer(motor * forced, load * forced)
    return found


def _single(law: Law) -> Build:
    return lambda motions: [law(m)[:, np.newaxis] for m in motions]


def _fixed(element: Element) -> list[Form]:
    return [Form(name, _single(law)) for name, law in LAWS[element].items()]


def _free(element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return any function of a signal: piecewise linear between knots."""
    found = []
    for name, signal in FREE[element].items():
        knots = knots_of(np.concatenate([signal(m) for m in motions]))
        if knots.size > 2:
            found.append(Form(f"a function of {name}", _function_of(signal, knots)))
    return found


def _function_of(signal: Law, knots: FloatArray) -> Build:
    return lambda motions: [hats(signal(m), knots) for m in motions]


def knots_of(values: FloatArray) -> FloatArray:
    """Return the knots of a free function of a signal, increasing."""
    return np.unique(np.percentile(values, np.linspace(1.0, 99.0, KNOTS)))


def hats(values: FloatArray, knots: FloatArray) -> FloatArray:
    """Return the piecewise linear basis on K knots, shape (N, K); constant beyond the ends."""
    return np.stack([np.interp(values, knots, unit) for unit in np.eye(knots.size)], axis=1)


def _shares(element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return that one input counts more than its reading, or is limited by itself; with one input there is no other."""
    inputs = min(m.inputs.shape[1] for m in motions)
    if element is not Element.TORQUE_PATH or inputs == 1:
        return []
    found = [Form(f"T_{j + 1} alone", _single(partial(_input, j))) for j in range(inputs - 1)]
    for j in range(inputs):
        top = _range(np.concatenate([_input(j, m) for m in motions]))
        found += [
            Form(f"T_{j + 1} beyond {share:g} of its range", _single(partial(_input_beyond, j, share * top)))
            for share in (0.5, 0.65, 0.8, 0.9)
        ]
    return found


def _input(index: int, motion: Motion) -> FloatArray:
    return motion.inputs[:, index]


def _input_beyond(index: int, limit: float, motion: Motion) -> FloatArray:
    torque = _input(index, motion)
    beyond: FloatArray = torque - np.clip(torque, -limit, limit)
    return beyond


MODULATIONS: Mapping[Element, Mapping[str, Law]] = {
    Element.TORQUE_PATH: {"": _one, "T ": _torque},
    Element.MOTOR: {},  # what depends on the motor's angle is the torque path's there
    Element.SHAFT: {"": _one},
    Element.LOAD: {"": _one},
    Element.SPEED_SENSOR: {"w ": _speed},
    Element.ACQUISITION: {},
}
"""What a wave over the angle is multiplied by."""


def _periodic(view: Scene, element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return waves over the motor's angle that the input at the element's place shows, each recording its phase."""
    found = []
    for prefix, modulation in MODULATIONS[element].items():
        inputs = view.explanations[PLACES[element]].inputs
        weighted = [each.value * modulation(m) for each, m in zip(inputs, motions, strict=True)]
        found += [
            Form(f"{prefix}wave {order:.3g} times per motor turn", partial(_waves, order, modulation))
            for order in dict.fromkeys([*USUAL_ORDERS, *peaks(weighted, [m.angle for m in motions])])
        ]
    return found


def _waves(order: float, modulation: Law, motions: Sequence[Motion]) -> list[Columns]:
    """Return cosine and sine of each recording, with coefficients of its own."""
    columns = []
    for i, motion in enumerate(motions):
        wide = np.zeros((motion.angle.size, 2 * len(motions)))
        size = modulation(motion)
        wide[:, 2 * i] = size * np.cos(order * motion.angle)
        wide[:, 2 * i + 1] = size * np.sin(order * motion.angle)
        columns.append(wide)
    return columns


def _changes(element: Element, motions: Sequence[Motion]) -> list[Form]:
    return [
        Form(f"{name} from {moment:.1f} s on in recording {i + 1}", partial(_from_moment, i, law, moment))
        for i, motion in enumerate(motions)
        for name, law in CHANGING[element].items()
        for moment in moments(motion, CHANGE_EVERY_S)
    ]


def _steps(result: FitResult, element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return steps of the load torque at every moment of a grid, and slow courses, each in one recording alone."""
    one_mass = result.problem.grid.structure is Structure.ONE_MASS
    if element is not (Element.MOTOR if one_mass else Element.LOAD):
        return []
    names = [record.name for record in result.problem.records]
    return [
        Form(f"load step at {moment:.1f} s in {names[i]}", partial(_from_moment, i, _one, moment))
        for i, motion in enumerate(motions)
        for moment in moments(motion, STEP_EVERY_S)
    ] + [Form(f"a slow course of the load in {name}", partial(_course, i)) for i, name in enumerate(names)]


def _from_moment(index: int, law: Law, moment: float, motions: Sequence[Motion]) -> list[Columns]:
    columns = [np.zeros((m.time_s.size, 1)) for m in motions]
    motion = motions[index]
    columns[index][:, 0] = np.where(motion.time_s >= moment, law(motion), 0.0)
    return columns


def _course(index: int, motions: Sequence[Motion]) -> list[Columns]:
    """Return a piecewise linear function of the time of one recording."""
    time_s = motions[index].time_s
    knots = np.linspace(time_s[0], time_s[-1], COURSE_KNOTS)
    columns = [np.zeros((m.time_s.size, COURSE_KNOTS)) for m in motions]
    columns[index] = hats(time_s, knots)
    return columns


def moments(motion: Motion, every_s: float) -> FloatArray:
    """Return the moments of a recording at which something may set in [s]."""
    length_s = float(motion.time_s[-1] - motion.time_s[0])
    every_s = max(every_s, length_s / MOST_MOMENTS)
    found: FloatArray = motion.time_s[0] + every_s * np.arange(1, max(int(length_s / every_s), 2))
    return found
