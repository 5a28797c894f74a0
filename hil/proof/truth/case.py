"""A case: a specimen, three recordings of it to diagnose, and three fresh ones to judge by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hil.proof.truth import laws
from hil.proof.truth.driver import bring_to_speed
from hil.proof.truth.experiments import PERIOD_S, Plan, Test, draw_plan, sample_times_s
from hil.proof.truth.kernel import State
from hil.proof.truth.physics import FloatArray, Physics
from hil.proof.truth.sensors import speed_reading, torque_reading
from hil.proof.truth.specimen import Specimen, Stream, draw_specimen, stream

TESTS = tuple(Test)

PROFILE_STRIDE = 25
"""The truth keeps the load's disturbance every 0.25 s."""


@dataclass(frozen=True, slots=True)
class TruthRecording:
    """One recording. Arrays of shape (N,); the first five are the columns of the contract.

    ``speed_true_rad_s`` and ``disturbance_nm``, the torque of hill and brake against the load every 0.25 s,
    are the truth and go into no recording file.
    """

    time_s: FloatArray
    torque_ref_nm: FloatArray
    torque_m1_nm: FloatArray
    torque_m2_nm: FloatArray
    speed_rad_s: FloatArray
    speed_true_rad_s: FloatArray
    disturbance_nm: FloatArray


@dataclass(frozen=True, slots=True)
class Case:
    """What the tool gets, and what judges it; ``recordings`` and ``fresh`` in the order of `TESTS`."""

    specimen: Specimen
    recordings: tuple[TruthRecording, ...]
    fresh: tuple[TruthRecording, ...]

    def truth(self) -> dict[str, object]:
        """Return what is sealed: JSON types only."""
        return {
            **self.specimen.truth(),
            "disturbance_period_s": PROFILE_STRIDE * PERIOD_S,
            "disturbance_nm": _disturbances(self.recordings),
            "disturbance_fresh_nm": _disturbances(self.fresh),
        }


def _disturbances(recordings: tuple[TruthRecording, ...]) -> list[list[float]]:
    return [recording.disturbance_nm.round(3).tolist() for recording in recordings]


def make_case(effect: str, seed: int) -> Case:
    """Draw a bus, hide an effect in it, record it.

    Raises
    ------
    UsageError
        If the effect is not registered.
    """
    specimen = draw_specimen(effect, seed)
    recordings = tuple(record(specimen, number) for number in range(2 * len(TESTS)))
    return Case(specimen, recordings[: len(TESTS)], recordings[len(TESTS) :])


def record(specimen: Specimen, number: int) -> TruthRecording:
    """Draw and drive the specimen's recording of a number from 0; the kinds of `TESTS` take turns."""
    rng = stream(specimen.seed, Stream.RECORDING, number)
    plan = draw_plan(TESTS[number % len(TESTS)], rng)
    rng_sensors, rng_effect = rng.spawn(2)
    return _drive(specimen.physics(rng_effect), plan, rng_sensors)


def _drive(physics: Physics, plan: Plan, rng: np.random.Generator) -> TruthRecording:
    rolling = bring_to_speed(physics, plan.speed_rad_s, plan.share_m1)
    bus = rolling.driveline
    torque = rolling.torque_nm + plan.torque_nm
    m1, m2 = plan.share_m1 * torque, (1.0 - plan.share_m1) * torque
    speed, disturbance = np.empty(torque.size), np.empty(torque.size)
    for row in range(torque.size):
        speed[row] = bus.speed_rad_s
        disturbance[row] = _disturbance_nm(physics, bus.state)
        bus.advance((m1[row], m2[row]), PERIOD_S)
    return TruthRecording(
        time_s=sample_times_s(),
        torque_ref_nm=torque,
        torque_m1_nm=torque_reading(m1, rng),
        torque_m2_nm=torque_reading(m2, rng),
        speed_rad_s=speed_reading(speed, rng),
        speed_true_rad_s=speed,
        disturbance_nm=disturbance[::PROFILE_STRIDE],
    )


def _disturbance_nm(physics: Physics, state: FloatArray) -> float:
    """Torque against the load beyond the constant one: hill and brake."""
    hill = laws.gravity_torque(physics, state[State.ANGLE_L])
    return hill + laws.brake_torque(physics, state[State.TIME_S])
