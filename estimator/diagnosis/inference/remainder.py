"""What a hypothesis leaves: whether noise would leave as much, and what of it its own past tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.thresholds import Checks, Noise
from estimator.physics.fit import FitResult
from estimator.physics.motion import measured_speed, motor_angle
from estimator.signals.record import FloatArray, Record

COLUMNS = {"most_predictable": Noise.PREDICTOR_ORDER, "most_dependent": 2 * Checks.BINS + 3}
"""How many signals a share of the innovations is sought in: past samples; bins, waves in the angle, and a mean."""

DISTURBANCES = {
    Size.TORQUE: "is more than the noise of a torque reading",
    Size.DRIFT: "is more than the drift of a torque reading",
    Size.WALK: "is more than the slow change of a load",
}


def unpredictable(errors: Sequence[FloatArray]) -> float:
    """Return the RMS of what a set of simulation errors' own past does not predict."""
    n = Noise.PREDICTOR_ORDER
    past = np.concatenate([np.lib.stride_tricks.sliding_window_view(error[:-1], n) for error in errors])
    now = np.concatenate([error[n:] for error in errors])
    left = now - past @ np.linalg.lstsq(past, now, rcond=None)[0]
    return float(np.sqrt(left @ left / max(left.size - n, 1)))


def residuals_by_record(result: FitResult) -> list[FloatArray]:
    """Split a fit's residual into those of its recordings, of the samples that count."""
    sizes = np.cumsum([int(use.sum()) for use in result.problem.use])[:-1]
    return list(np.split(result.residual, sizes))


@dataclass(frozen=True, slots=True)
class Test:
    """One property that noise has: how far an error is from it, and the most that noise shows."""

    name: str  # what an error that fails it does, in words
    value: float  # of the error
    most: float  # above it the error is more than noise
    key: str = ""  # of `thresholds.toml`; "" for a size of the noise model at its bound

    @property
    def failed(self) -> bool:
        """Whether it is more than noise."""
        return self.value > self.most


def tests(best: Hypothesis) -> tuple[Test, ...]:
    """Test what a hypothesis leaves for all that noise may not do; each says how far it is from that."""
    problem = best.result.problem
    errors = residuals_by_record(best.white)
    whole = np.concatenate(errors)
    power = float(whole @ whole) / whole.size
    limited = (
        ("most_predictable", "is correlated over time", 1.0 - unpredictable(errors) ** 2 / power),
        ("most_dependent", "depends on torque, speed or angle", _dependent(best, whole)),
        ("most_line", "has a line in its spectrum", max(_line(each) for each in errors)),
        ("most_change", "changes in size over time", _change(errors, problem.records, power)),
    )
    bounded = (Test(name, float(_is_at_bound(best, size)), 0.5) for size, name in _bounded(best))
    return (
        *(Test(name, value, Checks.TEST_LIMITS[key] + chance(key, whole.size), key) for key, name, value in limited),
        *bounded,
    )


def chance(key: str, samples: int) -> float:
    """Return how large a share of so many samples' variance a test finds in noise by chance; 0 where it is no share."""
    return Checks.CHANCE * math.sqrt(2.0 * COLUMNS[key]) / samples if key in COLUMNS else 0.0


def _bounded(best: Hypothesis) -> list[tuple[Size, str]]:
    return [(size, name) for size, name in DISTURBANCES.items() if best.limits.low[size] < best.limits.high[size]]


def _is_at_bound(best: Hypothesis, size: Size) -> bool:
    return bool(best.sizes[size] > best.limits.high[size] - Checks.EDGE)


def _dependent(best: Hypothesis, whole: FloatArray) -> float:
    """Return the share of the innovations' variance that is a function of torque, speed or angle, bias removed."""
    problem = best.result.problem
    torque, speed, angle = (
        np.concatenate([signal(record)[use] for record, use in zip(problem.records, problem.use, strict=True)])
        for signal in (_driven_by, lambda r: np.nan_to_num(measured_speed(r)), motor_angle)
    )
    columns = [np.ones(whole.size)]
    for signal in (torque, speed):
        edges = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, Checks.BINS + 1)[1:-1]))
        columns += [(np.digitize(signal, edges) == i).astype(float) for i in range(edges.size)]
    columns += [wave(times * angle) for times in (1.0, 2.0) for wave in (np.sin, np.cos)]
    basis = np.linalg.qr(np.column_stack(columns))[0]
    explained = float(np.sum((basis.T @ whole) ** 2)) / float(whole @ whole)
    return explained - len(columns) / whole.size


def _driven_by(record: Record) -> FloatArray:
    """Return what drives a line: its torque; of a joint, whose torque is what is read, the imposed motion."""
    return record.total_torque_nm if record.imposed is None else record.imposed


def _line(error: FloatArray) -> float:
    """Return the largest power at one frequency over the mean power; of what repeats often enough to be a line."""
    power = np.abs(np.fft.rfft(error))[1:] ** 2
    return float(power[Checks.FEWEST_PERIODS - 1 :].max() / power.mean())


def _change(errors: Sequence[FloatArray], records: Sequence[Record], power: float) -> float:
    """Return the largest mean square over a second, or 50 samples, less the mean of all, in standard deviations."""
    found = 0.0
    for error, record in zip(errors, records, strict=True):
        length = max(1, min(max(round(Checks.CHANGE_S / record.sample_time_s), Checks.MIN_SAMPLES), error.size))
        squares = (error[: error.size // length * length] ** 2).reshape(-1, length).mean(axis=1)
        found = max(found, (float(squares.max()) / power - 1.0) * math.sqrt(0.5 * length))
    return found
