"""One mass with known effects, and what selects on its recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.holdout import Examiner
from estimator.diagnosis.hypotheses import everything, open_hypotheses
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.selection import Selector
from estimator.diagnosis.selection.jury import Jury
from estimator.diagnosis.selection.rounds import Rounds
from estimator.diagnosis.weight import Weight
from estimator.physics.start import Start
from estimator.signals.record import Record
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, rubbing_speed
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, random_steps, record

LINE = model(ONE_MASS)
COULOMB, STRIBECK = "coulomb_friction_motor", "stribeck_friction"


def silent(message: str, share: float) -> None:
    """Nobody listens."""


def jury(records: Sequence[Record], names: Sequence[str] | None = None, floor: float | None = None) -> Jury:
    found, _ = open_hypotheses(LINE, records)
    bench = Bench(LINE, records, everything(records))
    level = noise_floor(records) if floor is None else floor
    return Jury(bench, Examiner(LINE, records, ()), found if names is None else names, Weight(level))


def selector(records: Sequence[Record], names: Sequence[str] | None = None) -> Selector:
    return Selector(jury(records, names), silent)


def rounds(records: Sequence[Record], names: Sequence[str]) -> Rounds:
    return Rounds(jury(records, names), silent)


def coulomb(speed: float) -> float:
    return 12.0


def stribeck(speed: float) -> float:
    return float(8.0 + 14.0 * np.exp(-((speed / 0.8) ** 2)))


def quadratic(coefficient: float) -> list[Record]:
    """Air drag instead of dry friction; the torque takes the speed through zero, so that it counts."""
    found = []
    for seed in (1, 2):
        torque = 4.0 * drive_torque(seed, 1200)
        speed = rubbing_speed(lambda w: coefficient * w * w, torque, Start(5.0, 0.0, 2.0))
        noise = SIGMA * np.random.default_rng(seed).standard_normal(torque.size)
        found.append(record(torque, speed + noise, name=f"run_{seed}"))
    return found


def lagged(time_constant_s: float) -> list[Record]:
    """Torque that follows its reading with a lag; the mean over each period is what moves the mass."""
    decay, found = np.exp(-0.01 / time_constant_s), []
    for seed in (1, 2):
        read = drive_torque(seed, 1200)
        behind = lfilter([0.0, 1.0 - decay], [1.0, -decay], read - read[0]) + read[0]
        true = read + (behind - read) * time_constant_s / 0.01 * (1.0 - decay)
        rec = linear_record(ONE_MASS, true, Start(5.0, 0.0, 2.0), sigma=SIGMA, seed=seed, name=f"run_{seed}")
        found.append(replace(rec, torque_nm=read[:, None]))
    return found


def twice_lagged(time_constant_s: float, sigma: float, parts: int = 10) -> list[Record]:
    """Torque behind two lags in a row, followed in parts of a period, on a mass that adds up what it gets."""
    decay, found = np.exp(-0.01 / parts / time_constant_s), []
    for seed in (1, 2):
        read = drive_torque(seed, 1200)
        behind = np.repeat(read - read[0], parts)
        for _ in range(2):
            behind = lfilter([1.0 - decay], [1.0, -decay], behind)
        true = behind.reshape(-1, parts).mean(axis=1) + read[0]
        rec = linear_record(ONE_MASS, true, Start(5.0, 0.0, 2.0), sigma=sigma, seed=seed, name=f"run_{seed}")
        found.append(replace(rec, torque_nm=read[:, None]))
    return found


BRAKE_NM = 12.0


def braked_records() -> list[Record]:
    """Forward all along; a brake drags for a while, not in the last recording."""
    time_s, found = np.arange(1200) * 0.01, []
    for seed, (begin, end) in {1: (2.0, 5.0), 2: (6.0, 9.5), 3: (0.0, 0.0)}.items():
        load = np.where((time_s >= begin) & (time_s < end), BRAKE_NM, 0.0)
        torque, start = random_steps(1200, seed, mean_nm=90.0), Start(5.0, 0.0, 20.0)
        found.append(
            linear_record(ONE_MASS, torque, start, sigma=SIGMA, seed=seed, name=f"run_{seed}", extra_load_nm=load)
        )
    return found


def late(records: Sequence[Record], samples: int) -> list[Record]:
    """The same motion with a torque that was read earlier than it acted."""
    return [
        replace(rec, torque_nm=np.vstack([rec.torque_nm[samples:], np.tile(rec.torque_nm[-1], (samples, 1))]))
        for rec in records
    ]
