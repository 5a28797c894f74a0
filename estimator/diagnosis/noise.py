"""Noise of a reading, and what errors say against it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from estimator.diagnosis.thresholds import Noise
from estimator.errors import NotExciting
from estimator.physics.fit import FitResult
from estimator.signals.correlation import effective_samples
from estimator.signals.record import BoolArray, FloatArray, Record


def noise_floor(records: Sequence[Record]) -> float:
    """Estimate the noise of the reading, from the data alone."""
    squares, count = 0.0, 0
    pairs = [(record, _usable(record)) for record in records]
    long = [(record, usable) for record, usable in pairs if usable.sum() >= Noise.FEWEST_PREDICTED]
    if not long:
        record, usable = max(pairs, key=lambda pair: int(pair[1].sum()))
        raise NotExciting(
            f"recording {record.name}: {usable.sum()} samples follow {Noise.PREDICTOR_ORDER} samples of which most are "
            f"good, expected at least {Noise.FEWEST_PREDICTED} to estimate the noise. Too many are masked: check flags "
            "and mask."
        )
    for record, usable in long:
        errors = _one_step_errors(record, usable)
        squares += float(errors @ errors)
        count += max(errors.size - 2 * Noise.PREDICTOR_ORDER - 1, 1)
    return float(np.sqrt(squares / count))


def _usable(record: Record) -> BoolArray:
    """Return which samples a predictor can be asked for, from the first with a whole past on."""
    if record.okay.size <= Noise.PREDICTOR_ORDER:
        return np.zeros(0, dtype=np.bool_)
    seen = np.lib.stride_tricks.sliding_window_view(record.okay, Noise.PREDICTOR_ORDER + 1).mean(axis=1)
    return record.okay[Noise.PREDICTOR_ORDER :] & (seen >= Noise.MOSTLY_GOOD)


def _one_step_errors(record: Record, usable: BoolArray) -> FloatArray:
    good = np.flatnonzero(record.okay)
    y = np.interp(np.arange(record.okay.size), good, record.output[good] - record.output[good].mean())
    u = record.total_torque_nm
    n = Noise.PREDICTOR_ORDER
    lags = range(1, n + 1)
    columns = [signal[n - lag : signal.size - lag] for signal in (y, u) for lag in lags]
    regressors = np.column_stack([*columns, np.ones(y.size - n)])
    a, b = regressors[usable], y[n:][usable]
    return b - a @ np.linalg.lstsq(a, b, rcond=None)[0]


def unpredictable(errors: Sequence[FloatArray]) -> float:
    """Return the RMS of what a set of simulation errors' own past does not predict."""
    n = Noise.PREDICTOR_ORDER
    past = np.concatenate([np.lib.stride_tricks.sliding_window_view(error[:-1], n) for error in errors])
    now = np.concatenate([error[n:] for error in errors])
    left = now - past @ np.linalg.lstsq(past, now, rcond=None)[0]
    return float(np.sqrt(left @ left / max(left.size - n, 1)))


@dataclass(frozen=True, slots=True)
class Gain:
    """What a larger model gains over a smaller one."""

    delta_bic: float  # information gained, residual correlation taken into account
    p_value: float  # of the gain, were the smaller model true
    n_effective: float  # independent samples the larger model's residual is worth


def residuals_by_record(result: FitResult) -> list[FloatArray]:
    """Split a fit's residual into those of its recordings, of the samples that count."""
    sizes = np.cumsum([int(use.sum()) for use in result.problem.use])[:-1]
    return list(np.split(result.residual, sizes))


def gain_from_squares(before: float, after: float, added: int, unknowns: int, errors: Sequence[FloatArray]) -> Gain:
    """Compare two nested least-squares fits by their sums of squares.

    ``delta_bic = n_e ln(S_0/S_1) - q ln n_e`` with the effective number of samples n_e of the larger model's
    ``errors`` (Schwarz, Ann. Stat. 6, 1978), and the F test with the same n_e.
    """
    n = max(effective_samples(errors), unknowns + 2.0)
    ratio = before / max(after, np.finfo(float).tiny)
    if ratio <= 1.0:
        return Gain(-added * math.log(n), 1.0, n)
    f_value = (ratio - 1.0) * (n - unknowns) / added
    p_value = max(float(stats.f.sf(f_value, added, n - unknowns)), Noise.SMALLEST_P)
    return Gain(n * math.log(ratio) - added * math.log(n), p_value, n)


def stretches(record: Record, parts: Sequence[slice], share: float) -> list[slice]:
    """Return the rows of a recording that are used, in order."""
    if share >= 1.0:
        return list(parts)
    longest = max(round(Noise.LONGEST_S / record.sample_time_s), 1)
    return [piece for part in parts for piece in _pieces(part, longest, share)]


def share_of(records: Sequence[Record]) -> float:
    """Return which part of the samples of all recordings may be used."""
    return Noise.MOST_SAMPLES / sum(record.okay.size for record in records)


def _pieces(part: slice, longest: int, share: float) -> list[slice]:
    size = part.stop - part.start
    allowed = min(size, max(math.ceil(share * size), longest))
    count = math.ceil(allowed / longest)
    length = allowed // count
    starts = part.start + np.linspace(0, size - length, count).astype(int)
    return [slice(int(start), int(start) + length) for start in starts]
