"""A linear driveline with a small disturbance planted at one place, solved by the matrix exponential.

The disturbance is a function of the motion it disturbs: a few passes of fixed-point iteration make the two agree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.problem import make_problem
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import (
    ANGLE,
    LOAD_SPEED,
    ONE_MASS,
    SAMPLE_TIME_S,
    SPEED,
    TWIST,
    TWO_MASS,
    exact_states,
    model,
    random_steps,
    record,
)

SIGMA = 0.02
SAMPLES = 1500
PASSES = 4
TIGHT = 0.05
"""Tolerance of the nominal parameters: a planted law shall not be tuned away."""


@dataclass(frozen=True)
class Moved:
    """What happens in the line; arrays of shape (N,)."""

    time_s: FloatArray
    torque: FloatArray
    angle: FloatArray
    speed: FloatArray
    twist: FloatArray
    load_speed: FloatArray


Law = Callable[[Moved], FloatArray]
Friction = Callable[[float], float]


def drive_torque(seed: int, samples: int = SAMPLES) -> FloatArray:
    """Random steps on a swell that takes the speed through zero several times."""
    swell = 80.0 * np.sin(2 * np.pi * np.arange(samples) * SAMPLE_TIME_S / 5.0 + seed)
    return random_steps(samples, seed) + swell


def disturbed(
    element: Element,
    law: Law,
    coefficient: float,
    torque: FloatArray,
    start: InitialCondition,
    values: Mapping[str, float] = TWO_MASS,
) -> FloatArray:
    """Motor speed under ``coefficient * law`` at an element: friction at the motor, torque carried by the shaft,
    load at the load, torque in the torque path, error of the reading."""
    time_s = np.arange(torque.size) * SAMPLE_TIME_S
    planted = np.zeros_like(torque)
    for _ in range(PASSES):
        drive, load, reading = _where(element, planted)
        states = exact_states(values, torque + drive, start, extra_load_nm=load)
        moved = Moved(time_s, torque, *(states[:, i] for i in (ANGLE, SPEED, TWIST, LOAD_SPEED)))
        planted = coefficient * law(moved)
    if element is Element.SPEED_SENSOR:
        reading = planted
    return states[:, SPEED] + reading


def _where(element: Element, planted: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    nothing = np.zeros_like(planted)
    return {
        Element.TORQUE_PATH: (planted, nothing, nothing),
        Element.MOTOR: (-planted, nothing, nothing),
        Element.SHAFT: (-planted, -planted, nothing),
        Element.LOAD: (nothing, planted, nothing),
        Element.SPEED_SENSOR: (nothing, nothing, nothing),
    }[element]


def recordings(
    element: Element,
    law: Law,
    coefficient: float,
    seeds: Sequence[int] = (1, 2),
    values: Mapping[str, float] = TWO_MASS,
    samples: int = SAMPLES,
) -> list[Record]:
    """Noisy recordings of the disturbed driveline."""
    found = []
    for seed in seeds:
        torque = drive_torque(seed, samples)
        speed = disturbed(element, law, coefficient, torque, InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0), values)
        noise = SIGMA * np.random.default_rng(seed).standard_normal(samples)
        found.append(record(torque, speed + noise, name=f"run_{seed}"))
    return found


def nominal_fit(
    records: Sequence[Record], values: Mapping[str, float] = TWO_MASS, tolerance: float = TIGHT
) -> FitResult:
    """Fit the nominal model within its tolerance."""
    line = model(values, tolerance)
    return fit(make_problem(line, records, nominal_unknowns(line)))


def nothing(moved: Moved) -> FloatArray:
    """Nothing is planted."""
    return np.zeros_like(moved.speed)


def rubbing_speed(friction: Friction, torque: FloatArray, start: InitialCondition, substeps: int = 20) -> FloatArray:
    """Speed of one mass under dry friction of ``friction(speed)`` Nm, by time stepping with an impulse (Moreau).

    Each sub-step moves freely, exactly; then friction takes off what it can, and all of it where the mass sticks.
    """
    j_m, b_m = ONE_MASS["J_M"], ONE_MASS["b_M"]
    h = SAMPLE_TIME_S / substeps
    decay = float(np.exp(-b_m / j_m * h))
    speed, found = start.speed_rad_s, []
    for value in torque.tolist():
        found.append(speed)
        settled = (value - start.load_torque_nm) / b_m
        for _ in range(substeps):
            free = settled + (speed - settled) * decay
            most = friction(free) * h / j_m
            speed = 0.0 if abs(free) <= most else free - np.copysign(most, free)
    return np.array(found)


def rubbing(
    friction: Friction, seeds: Sequence[int] = (1, 2), samples: int = 1200, sigma: float = SIGMA
) -> list[Record]:
    """Noisy recordings of one mass with dry friction."""
    found = []
    for seed in seeds:
        torque = drive_torque(seed, samples)
        noise = sigma * np.random.default_rng(seed).standard_normal(samples)
        speed = rubbing_speed(friction, torque, InitialCondition(5.0, 0.0, 2.0))
        found.append(record(torque, speed + noise, name=f"run_{seed}"))
    return found


def quiet(
    seeds: Sequence[int] = (1, 2), values: Mapping[str, float] = TWO_MASS, samples: int = SAMPLES
) -> list[Record]:
    """Recordings in which nothing is missing."""
    return recordings(Element.MOTOR, nothing, 0.0, seeds, values, samples)
