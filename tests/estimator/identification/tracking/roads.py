"""Drives on a road, with a driver, whose stiffness and PRBS change on the way: the road of `hil paper`, other buses."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from estimator.signals.prbs import Prbs
from estimator.signals.record import FloatArray, Record
from hil.figures.local_model import TwoMassLine
from hil.figures.road import Bus, Conditions, PedalCruise, RoadLoad, draw_conditions
from hil.proof.truth.bus import draw_bus
from hil.proof.truth.recording import speed_reading, torque_reading
from hil.rig.experiments.laws import Cruise

PERIOD_S = 0.01
CHUNK_S = 1.0
"""Time over which the stiffness stays as it is."""

Course = Callable[[float], float]
"""A quantity over time [s]."""


@dataclass(frozen=True)
class Drive:
    """What was recorded, and the natural frequency as it truly was, at each sample [Hz]."""

    record: Record
    frequency_hz: FloatArray


def drive(
    seed: int, duration_s: float, prbs_nm: Course = lambda time_s: 120.0, stiffness: Course = lambda time_s: 1.0
) -> Drive:
    """Drive a bus drawn at random: PRBS amplitude [Nm] and stiffness, over that at the start, change with time."""
    conditions = draw_conditions(seed, 1)[0]
    truth = draw_bus(np.random.default_rng([seed, 2]))
    line = TwoMassLine(truth.J_M, truth.J_L, truth.k, truth.c, truth.b_M, truth.b_L)
    bus = Bus(truth.J_L / truth.metres_per_rad**2, truth.metres_per_rad)
    n = round(duration_s / PERIOD_S)
    torque, speed, frequency_hz = np.empty(n), np.empty(n), np.empty(n)
    load, law = RoadLoad(bus, conditions), _driver(conditions, truth.J_M + truth.J_L)
    prbs = Prbs(1.0, clock_divider=2, seed=conditions.prbs_seed)
    holding_nm = (
        load.torque_nm(conditions.speed_rad_s, 0.0, PERIOD_S) + (truth.b_M + truth.b_L) * conditions.speed_rad_s
    )
    law.begin(holding_nm)
    x, distance_m = np.array([conditions.speed_rad_s, conditions.speed_rad_s, holding_nm / truth.k]), 0.0
    for k in range(n):
        time_s = k * PERIOD_S
        if k % round(CHUNK_S / PERIOD_S) == 0:
            now = replace(line, stiffness_nm_per_rad=truth.k * stiffness(time_s))
            a, b = now.discrete(PERIOD_S)
            mode = now.resonance
            assert mode is not None
        torque[k] = law.torque_nm(time_s, float(x[0])) + prbs_nm(time_s) * prbs.next()
        speed[k], frequency_hz[k] = x[0], mode.frequency_hz
        load_nm = load.torque_nm(float(x[1]), distance_m, PERIOD_S)
        distance_m += float(x[1]) * bus.metres_per_rad * PERIOD_S
        x = a @ x + b @ np.array([torque[k], load_nm])
    return Drive(_read(seed, torque, speed), frequency_hz)


def _driver(conditions: Conditions, inertia_kg_m2: float) -> PedalCruise:
    cruise = Cruise(conditions.speed_rad_s, np.inf, inertia_kg_m2, 1e4, PERIOD_S)
    return PedalCruise(cruise, conditions.pedal_nm, PERIOD_S, np.random.default_rng([conditions.seed, 1]))


def _read(seed: int, torque_nm: FloatArray, speed_rad_s: FloatArray) -> Record:
    rng = np.random.default_rng([seed, 3])
    halves = np.column_stack([torque_reading(0.5 * torque_nm, rng), torque_reading(0.5 * torque_nm, rng)])
    time_s = PERIOD_S * np.arange(torque_nm.size)
    okay = np.ones(torque_nm.size, dtype=np.bool_)
    return Record(f"road_{seed}", PERIOD_S, time_s, halves, speed_reading(speed_rad_s, rng), okay)
