"""Drives without noise: what a bus with an effect does, and what one without it would under the same torques.

The speed is kept every period, before the torque of the period acts, as the recorder does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from hil.proof.truth import kernel
from hil.proof.truth.case import TESTS
from hil.proof.truth.compiled import compiled
from hil.proof.truth.driver import bring_to_speed
from hil.proof.truth.experiments import PERIOD_S, Plan, draw_plan
from hil.proof.truth.inverters import true_torque
from hil.proof.truth.physics import FloatArray, Physics
from hil.proof.truth.specimen import Specimen, Stream, stream
from hil.proof.truth.state import State


@dataclass(frozen=True, slots=True)
class Drive:
    """One test of one specimen, without noise.

    Attributes
    ----------
    physics : Physics
    state : ndarray, shape (STATES,)
        State at the beginning, in the order of `State`.
    m1_nm, m2_nm : ndarray, shape (N,)
        Torque of the inverters, as they would read it without noise.
    """

    physics: Physics
    state: FloatArray
    m1_nm: FloatArray
    m2_nm: FloatArray

    def speed_rad_s(self) -> FloatArray:
        """Return the motor's speed every period, shape (N,)."""
        torque = partial(true_torque, self.physics)
        pairs = zip(self.m1_nm.tolist(), self.m2_nm.tolist(), strict=True)
        total_nm = np.array([torque(pair, row * PERIOD_S) for row, pair in enumerate(pairs)])
        return _speeds(self.state.copy(), self.physics, total_nm)


@compiled
def _speeds(state: FloatArray, physics: Physics, total_nm: FloatArray) -> FloatArray:
    speeds = np.empty(total_nm.size)
    for row in range(total_nm.size):
        speeds[row] = state[State.SPEED_M]
        kernel.advance(state, physics, total_nm[row], PERIOD_S)
    return speeds


def plan_of(seed: int, test: int) -> Plan:
    """Return what the driver does in a seed's recording to diagnose of a number from 0."""
    return draw_plan(TESTS[test], stream(seed, Stream.RECORDING, test))


def drive(specimen: Specimen, test: int, samples: int) -> Drive:
    """Return a test of a specimen as it is driven, its first samples."""
    physics = _physics(specimen, test)
    plan = plan_of(specimen.seed, test)
    rolling = bring_to_speed(physics, plan.speed_rad_s, plan.share_m1)
    torque_nm = (rolling.torque_nm + plan.torque_nm)[:samples]
    m1_nm, m2_nm = plan.share_m1 * torque_nm, (1.0 - plan.share_m1) * torque_nm
    return Drive(physics, rolling.driveline.state, m1_nm, m2_nm)


def under_torques_of(other: Drive, specimen: Specimen, test: int) -> Drive:
    """Return the test as a specimen does it under the torques of another; both begin rolling steadily."""
    own = drive(specimen, test, other.m1_nm.size)
    return Drive(own.physics, own.state, other.m1_nm, other.m2_nm)


def _physics(specimen: Specimen, test: int) -> Physics:
    return specimen.physics(np.random.default_rng(0), test)  # what has one size leaves nothing to the drive to draw
