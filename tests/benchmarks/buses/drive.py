"""A cruise: the line under PRBS, driver and road, read as the rig reads it.

Row k of a recording holds the speed at ``time_s[k]`` and the torques that act from there to ``time_s[k+1]``. An
inverter takes its command and gives its reading in 0.1 % of 600 Nm (CiA 402, objects 0x6071 and 0x6077); between the
two lies its ripple, which acts on the shaft. The road changes ten times within a period.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.signals.record import Record
from tests.benchmarks.buses.bus import Bus
from tests.benchmarks.buses.foot import Foot
from tests.benchmarks.buses.line import LOAD, MOTOR, STATES, Array
from tests.benchmarks.buses.road import load_torque

PERIOD_S = 0.01
ROAD_STEPS = 10
COUNT_NM = 0.6
"""0.1 % of an inverter's rated 600 Nm."""

SETTLING_S = 20.0
"""Driven before the recording begins: the driver has found the torque by then."""

ROLLING_NM = 80.0
"""Constant part of the load torque at the motor [Nm]: 0.8 to 1 % of a bus's weight."""

CELLS, TAPS = 10, (10, 7)
"""Of the shift register: x^10 + x^7 + 1 is primitive, so that it repeats after 1023 steps."""


@dataclass(frozen=True, slots=True)
class World:
    """What of the world there is around the line."""

    road: bool = True
    driver: bool = True


ON_THE_ROAD, CLEAN = World(), World(road=False, driver=False)


def drive(bus: Bus, seconds: float = 30.0, seed: int = 0, world: World = ON_THE_ROAD) -> Record:
    """Drive a bus and return the recording at 10 ms.

    Parameters
    ----------
    bus
        Drawn by :func:`tests.benchmarks.buses.bus.draw_bus`.
    seconds
        Length of the recording [s].
    seed
        Of this drive: another road, other noise, another state of the shift register.
    world
        With road and driver; ``CLEAN`` has neither.
    """
    rng = np.random.default_rng([bus.seed, seed])
    kept, settling = round(seconds / PERIOD_S), round(SETTLING_S / PERIOD_S)
    n = kept + settling
    half_prbs_nm = 0.5 * bus.prbs_nm * prbs(n, int(rng.integers(1, 2**CELLS)))
    ripple_nm = rng.normal(0.0, bus.ripple_nm, (n, 2))
    noise = rng.normal(0.0, bus.noise_rad_s, n)
    pushes = _load_moves(bus, n, rng, world)
    held_nm = (bus.line.b_M + bus.line.b_L) * bus.speed_rad_s + ROLLING_NM
    foot = Foot(bus, held_nm, PERIOD_S)
    A, B = bus.line.held(PERIOD_S)
    x, torque, speed = _rolling(bus, held_nm), np.empty((n, 2)), np.empty(n)
    shares = np.array([bus.share, 1.0 - bus.share])
    for row in range(n):
        speed[row] = x[2 + MOTOR] + noise[row]
        asked_nm = foot.torque_nm(float(speed[row])) if world.driver else held_nm
        torque[row] = in_counts(asked_nm * shares + half_prbs_nm[row]) + ripple_nm[row]
        x = A @ x + B[:, MOTOR] * torque[row].sum() + pushes[row]
    time_s: Array = PERIOD_S * np.arange(kept, dtype=np.float64)
    readings, okay = in_counts(torque[settling:]), np.ones(kept, dtype=np.bool_)
    return Record(f"bus_{bus.seed}_{seed}", PERIOD_S, time_s, readings, speed[settling:], okay)


def in_counts(torque_nm: Array) -> Array:
    """Return torques as an inverter's object holds them: whole counts [Nm]."""
    return np.asarray(COUNT_NM * np.round(torque_nm / COUNT_NM), dtype=np.float64)


def prbs(n: int, state: int) -> Array:
    """Return n values of +1 and -1 of the ten-cell shift register from a state that is not 0."""
    values = np.empty(n)
    for i in range(n):
        values[i] = 1.0 if state & 1 else -1.0
        fed_back = (state >> (CELLS - TAPS[0]) ^ state >> (CELLS - TAPS[1])) & 1
        state = state >> 1 | fed_back << (CELLS - 1)
    return values


def _rolling(bus: Bus, held_nm: float) -> Array:
    """Return the state of steady rolling: the shaft twisted by what the load takes."""
    x = np.zeros(STATES)
    x[MOTOR] = (held_nm - bus.line.b_M * bus.speed_rad_s) / bus.line.k
    x[2:] = bus.speed_rad_s
    return x


def _load_moves(bus: Bus, n: int, rng: np.random.Generator, world: World) -> Array:
    """Return what the load torque adds to the state in each period, shape (n, 4)."""
    step_s = PERIOD_S / ROAD_STEPS
    load_nm = np.full((n, ROAD_STEPS), ROLLING_NM)
    if world.road:
        load_nm += load_torque(bus, n * ROAD_STEPS, step_s, rng).reshape(n, ROAD_STEPS)
    A, B = bus.line.held(step_s)
    moves = np.empty((ROAD_STEPS, STATES))
    move = B[:, LOAD]
    for step in reversed(range(ROAD_STEPS)):
        moves[step] = move
        move = A @ move
    return np.asarray(load_nm @ moves, dtype=np.float64)
