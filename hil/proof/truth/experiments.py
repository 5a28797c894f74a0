"""The three tests of a case: cruise, reversal through standstill, tip-in and tip-out; 30 s at 10 ms each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from hil.proof.truth.physics import FloatArray

PERIOD_S = 0.01
SAMPLES = 3000
DURATION_S = SAMPLES * PERIOD_S


class Test(Enum):
    """Kinds of test, in the order of the recordings."""

    CRUISE = "cruise"
    REVERSAL = "reversal"
    TIP_IN_OUT = "tip_in_out"


@dataclass(frozen=True, slots=True)
class Plan:
    """What the driver does in one test.

    Attributes
    ----------
    speed_rad_s : float
        Motor speed the bus rolls at when the recording begins, on level road.
    torque_nm : ndarray, shape (N,)
        Torque of both inverters on top of what holds that speed.
    share_m1 : float
        Part of the torque that inverter m1 gives.
    """

    speed_rad_s: float
    torque_nm: FloatArray
    share_m1: float


def _prbs(rng: np.random.Generator, amplitude_nm: float) -> FloatArray:
    """Pseudo-random binary torque of a ten-cell shift register, a bit every two or three samples."""
    cells = rng.integers(0, 2, 10)
    cells[rng.integers(0, 10)] = 1  # a register of zeros would stay there
    hold = int(rng.integers(2, 4))
    bits = np.empty(SAMPLES // hold + 1)
    for i in range(bits.size):
        bits[i] = cells[9]
        cells = np.concatenate(([cells[9] ^ cells[6]], cells[:9]))
    signs: FloatArray = 2.0 * np.repeat(bits, hold)[:SAMPLES] - 1.0
    return amplitude_nm * signs


def sample_times_s() -> FloatArray:
    """Return the time of each row, shape (SAMPLES,)."""
    return np.arange(SAMPLES, dtype=np.float64) * PERIOD_S


def _cruise(rng: np.random.Generator) -> Plan:
    slow = rng.uniform(20.0, 60.0) * np.sin(2.0 * np.pi * (sample_times_s() / rng.uniform(18.0, 25.0) + rng.random()))
    return Plan(rng.uniform(45.0, 90.0), slow + _prbs(rng, rng.uniform(100.0, 130.0)), rng.uniform(0.45, 0.55))


def _reversal(rng: np.random.Generator) -> Plan:
    phase = 2.0 * np.pi * sample_times_s() / rng.uniform(10.0, 14.0) + rng.uniform(-1.2, -0.2)
    swing = rng.uniform(330.0, 450.0) * np.cos(phase)
    return Plan(0.0, swing + _prbs(rng, rng.uniform(55.0, 75.0)), rng.uniform(0.6, 0.7))


def _tip_in_out(rng: np.random.Generator) -> Plan:
    pedal = np.sign(np.sin(2.0 * np.pi * (sample_times_s() / rng.uniform(2.2, 3.0) + rng.random())))
    torque = rng.uniform(170.0, 210.0) * pedal + _prbs(rng, rng.uniform(50.0, 65.0))
    return Plan(rng.uniform(40.0, 80.0), torque, rng.uniform(0.3, 0.4))


_PLANS: dict[Test, Callable[[np.random.Generator], Plan]] = {
    Test.CRUISE: _cruise,
    Test.REVERSAL: _reversal,
    Test.TIP_IN_OUT: _tip_in_out,
}


def draw_plan(test: Test, rng: np.random.Generator) -> Plan:
    """Draw one test of a kind."""
    return _PLANS[test](rng)
