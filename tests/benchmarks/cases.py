"""Recordings of the proof's buses, as long and as finely sampled as a benchmark asks for.

The proof records 30 s at 10 ms. A longer recording here is one drive through several of its plans, one after the other;
a faster one is the same drive read more often. All are made by ``hil.proof.truth``, which shares nothing with the model
that is fitted.
"""

import math
from dataclasses import dataclass

import numpy as np

from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import FloatArray, Record
from hil.proof.truth.bus import DURATION_S, NOMINAL_TOLERANCE, PERIOD_S, Test, draw_plan
from hil.proof.truth.case import TESTS
from hil.proof.truth.driveline import bring_to_speed
from hil.proof.truth.recording import speed_reading, torque_reading
from hil.proof.truth.specimen import Specimen, Stream, draw_specimen, stream

NOTHING = "none"


@dataclass(frozen=True, slots=True)
class Case:
    """A nominal model, and recordings of a bus that may hide something; one of each test, in turn."""

    model: DrivelineModel
    records: tuple[Record, ...]


def make(effect: str, seed: int, duration_s: float = DURATION_S, reads_per_period: int = 1, tests: int = 3) -> Case:
    """Draw a bus, hide an effect in it and record each test once."""
    specimen = draw_specimen(effect, seed)
    records = tuple(_record(specimen, number, duration_s, reads_per_period) for number in range(tests))
    return Case(nominal_model(specimen), records)


def nominal_model(specimen: Specimen) -> DrivelineModel:
    """Return all that a tool knows of a bus."""
    parameters = {name: Parameter(value, NOMINAL_TOLERANCE) for name, value in specimen.nominal.items()}
    return DrivelineModel(Structure.TWO_MASS, parameters, gear_ratio=specimen.bus.gear_ratio)


def _record(specimen: Specimen, number: int, duration_s: float, reads_per_period: int) -> Record:
    rng = stream(specimen.seed, Stream.RECORDING, number)
    test = TESTS[number % len(TESTS)]
    speed_rad_s, share, torque_nm = _drive_plan(test, rng, duration_s)
    rng_sensors, rng_effect = rng.spawn(2)
    rolling = bring_to_speed(specimen.physics(rng_effect, number), speed_rad_s, share)
    held_nm = rolling.torque_nm + torque_nm
    pair_nm = np.column_stack([share * held_nm, (1.0 - share) * held_nm])
    pair_nm = np.repeat(pair_nm, reads_per_period, axis=0)
    period_s = PERIOD_S / reads_per_period
    speed = np.empty(pair_nm.shape[0])
    for row, (m1_nm, m2_nm) in enumerate(pair_nm.tolist()):
        speed[row] = rolling.driveline.speed_rad_s
        rolling.driveline.advance((m1_nm, m2_nm), period_s)
    return Record(
        name=f"run_{number + 1}",
        sample_time_s=period_s,
        time_s=period_s * np.arange(speed.size, dtype=np.float64),
        torque_nm=torque_reading(pair_nm, rng_sensors),
        output=speed_reading(speed, rng_sensors),
        okay=np.ones(speed.size, dtype=np.bool_),
    )


def _drive_plan(test: Test, rng: np.random.Generator, duration_s: float) -> tuple[float, float, FloatArray]:
    """Return speed at the start [rad/s], share of inverter m1 and torque of each 10 ms [Nm], of one plan or several."""
    plans = [draw_plan(test, rng) for _ in range(math.ceil(duration_s / DURATION_S))]
    torque_nm = np.concatenate([plan.torque_nm for plan in plans])[: round(duration_s / PERIOD_S)]
    return plans[0].speed_rad_s, plans[0].share_m1, torque_nm
