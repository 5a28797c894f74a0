"""How the output answers to a disturbance at each place of the chain: the tool that locates what has no name.

A law without a name is a function of what is known to happen in the line (speed, twist, angle, torque, time), acting
as a torque at motor, shaft or load, in the torque path, or as an error of the reading. The answer of the output to
each such function is simulated around a fit; regression then tells which of them the error looks like.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from estimator.physics import kernel
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, local_part, start_of
from estimator.physics.model import Structure
from estimator.physics.motion import torque_scale
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, OutputKind, Record

NUDGE = 0.005
"""Size of a simulated disturbance, as a share of the torque in use: small enough to be linear."""

LOAD_STEP_EVERY_S = 0.5
"""Grid of the moments at which a load torque may step."""

ROUNDED = 0.02
"""A sign function changes over this share of its argument's range."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What a fit says happens in one recording; arrays of shape (N,)."""

    time_s: FloatArray
    torque: FloatArray
    angle: FloatArray
    speed: FloatArray
    twist: FloatArray
    load_speed: FloatArray


@dataclass(frozen=True, slots=True)
class Candidate:
    """A law without a name and the output's answer to it.

    Attributes
    ----------
    law : str
        The function, as text.
    answers : tuple of ndarray, shape (N_i,)
        Per recording, the change of the output per unit of the law's coefficient.
    """

    element: Element
    law: str
    answers: tuple[FloatArray, ...]


Law = Callable[[Motion], FloatArray]


def _sign(values: FloatArray) -> FloatArray:
    width = ROUNDED * max(float(np.percentile(np.abs(values), 99)), np.finfo(float).tiny)
    rounded: FloatArray = np.tanh(values / width)
    return rounded


def _rate(values: FloatArray, time_s: FloatArray) -> FloatArray:
    slope: FloatArray = np.gradient(values, time_s)
    return slope


MOTOR_LAWS: Mapping[str, Law] = {
    "sign(w_M)": lambda m: _sign(m.speed),
    "w_M |w_M|": lambda m: m.speed * np.abs(m.speed),
    "w_M exp(-t/T)": lambda m: m.speed * np.exp(-(m.time_s - m.time_s[0]) / 10.0),
    "dw_M/dt": lambda m: _rate(m.speed, m.time_s),
}

SHAFT_LAWS: Mapping[str, Law] = {
    "twist |twist|": lambda m: m.twist * np.abs(m.twist),
    "twist^3": lambda m: m.twist**3,
    "sign(twist)": lambda m: _sign(m.twist),
    "sign(d twist/dt)": lambda m: _sign(m.speed - m.load_speed),
}

LOAD_LAWS: Mapping[str, Law] = {
    "sign(w_L)": lambda m: _sign(m.load_speed),
    "w_L |w_L|": lambda m: m.load_speed * np.abs(m.load_speed),
    "dw_L/dt": lambda m: _rate(m.load_speed, m.time_s),
}

TORQUE_LAWS: Mapping[str, Law] = {
    "dT/dt": lambda m: np.diff(m.torque, prepend=m.torque[0]),  # what a late torque still lacks, in each period
    "T |T|": lambda m: m.torque * np.abs(m.torque),
    "T": lambda m: m.torque,
    "T t": lambda m: m.torque * (m.time_s - m.time_s[0]),
}

READING_LAWS: Mapping[str, Law] = {
    "dw/dt": lambda m: _rate(m.speed, m.time_s),
    "|w|": lambda m: np.abs(m.speed),
    "sin(angle)": lambda m: m.speed * np.sin(m.angle),
    "cos(angle)": lambda m: m.speed * np.cos(m.angle),
    "sin(2 angle)": lambda m: m.speed * np.sin(2 * m.angle),
    "cos(2 angle)": lambda m: m.speed * np.cos(2 * m.angle),
}


def candidates(result: FitResult) -> list[Candidate]:
    """Return every law without a name, with the output's answer to it around a fit."""
    motions = [motion_of(result, i) for i in range(len(result.problem.records))]
    two = result.problem.grid.structure is Structure.TWO_MASS
    places: list[tuple[Element, Mapping[str, Law]]] = [
        (Element.TORQUE_PATH, TORQUE_LAWS),
        (Element.MOTOR, MOTOR_LAWS),
        (Element.SPEED_SENSOR, READING_LAWS),
    ]
    places += [(Element.SHAFT, SHAFT_LAWS), (Element.LOAD, LOAD_LAWS)] if two else []
    found = [
        Candidate(element, name, tuple(_answer(result, i, element, law(m)) for i, m in enumerate(motions)))
        for element, laws in places
        for name, law in laws.items()
        if not (element is Element.SPEED_SENSOR and result.problem.records[0].kind is not OutputKind.SPEED)
    ]
    return found + _input_shares(result) + _load_steps(result)


def motion_of(result: FitResult, index: int) -> Motion:
    """Simulate every state of one recording at a fit."""
    problem = result.problem
    record, basis = problem.records[index], problem.local[index]
    start = start_of(problem, result.x, index)
    load = basis.extra_load(local_part(problem, result.x, index))
    angle, speed, twist, load_speed = (
        simulate(problem.grid, record, result.p, start, load, output=state)
        for state in (kernel.ANGLE, kernel.SPEED, kernel.TWIST, kernel.LOAD_SPEED)
    )
    return Motion(record.time_s, record.total_torque_nm, angle, speed, twist, load_speed)


def _answer(result: FitResult, index: int, element: Element, law: FloatArray) -> FloatArray:
    """Return the output's change per unit of a law, by a small disturbance of the simulation."""
    record = result.problem.records[index]
    if element is Element.SPEED_SENSOR:
        return law
    size = float(np.max(np.abs(law)))
    if size == 0.0:
        return np.zeros_like(law)
    nudge = NUDGE * torque_scale([record]) / size
    drive = {Element.TORQUE_PATH: 1.0, Element.MOTOR: -1.0, Element.SHAFT: -1.0, Element.LOAD: 0.0}[element]
    load = {Element.TORQUE_PATH: 0.0, Element.MOTOR: 0.0, Element.SHAFT: -1.0, Element.LOAD: 1.0}[element]
    return _nudged(result, index, drive * nudge * law, load * nudge * law) / nudge


def _nudged(result: FitResult, index: int, drive_nm: FloatArray, load_nm: FloatArray) -> FloatArray:
    problem = result.problem
    record, basis = problem.records[index], problem.local[index]
    torque = record.torque_nm.copy()
    torque[:, 0] += drive_nm
    extra = basis.extra_load(local_part(problem, result.x, index))
    load = load_nm if extra is None else extra + load_nm
    start = start_of(problem, result.x, index)
    moved: FloatArray = simulate(problem.grid, replace(record, torque_nm=torque), result.p, start, load)
    return moved - result.outputs[index]


def _input_shares(result: FitResult) -> list[Candidate]:
    """Return the candidates that one input counts more than its reading, one per input but the last."""
    records = result.problem.records
    inputs = min(record.torque_nm.shape[1] for record in records)
    return [
        Candidate(
            Element.TORQUE_PATH,
            f"T_{j + 1} alone",
            tuple(_answer(result, i, Element.TORQUE_PATH, r.torque_nm[:, j]) for i, r in enumerate(records)),
        )
        for j in range(inputs - 1)
    ]


def _load_steps(result: FitResult) -> list[Candidate]:
    """Return steps of the load torque at every moment of a grid, each in one recording alone."""
    element = Element.LOAD if result.problem.grid.structure is Structure.TWO_MASS else Element.MOTOR
    records = result.problem.records
    found = []
    for i, record in enumerate(records):
        for moment in _step_moments(record):
            load = (record.time_s >= moment).astype(float)
            nudge = NUDGE * torque_scale([record])
            answers = [np.zeros_like(other.output) for other in records]
            answers[i] = _nudged(result, i, np.zeros_like(load), nudge * load) / nudge
            found.append(Candidate(element, f"load step at {moment:.1f} s in {record.name}", tuple(answers)))
    return found


def _step_moments(record: Record) -> FloatArray:
    count = max(int((record.time_s[-1] - record.time_s[0]) / LOAD_STEP_EVERY_S) - 1, 1)
    every = max(1, count // 120)
    moments: FloatArray = record.time_s[0] + LOAD_STEP_EVERY_S * np.arange(1, count + 1, every)
    return moments
