"""Torques that were not read, estimated from what the output did: regularised least squares on a fit's error.

With the answer h of the output to a torque pulse of one sample, corrections d_j of the unknown torques change the
simulated output by ``sum_j h[k - j] d_j``. The error then left is smallest, in the sense of maximum posterior
probability, at::

    min  sum_k (simulated_k + sum_j h[k - j] d_j - measured_k)^2 / s^2  +  sum_j d_j^2 / v_j

v_j is the variance of the torque's change over as many samples as row j is away from a reading; d_j counts from the
torque as it was filled in there, whatever an earlier estimate has added to it. The constant load
torque and the start of the recording may have absorbed part of the wrong torque; their answers are fitted along, free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from estimator.diagnosis.acquisition.readings import all_of, any_of, runs
from estimator.errors import BadShape
from estimator.signals.record import BoolArray, FloatArray, Record

MOST_UNKNOWN = 0.2
"""With more than this share of the torques unknown the record is left as it is: the corrections would follow whatever
the model gets wrong."""

LONGEST_RUN = 50
"""Longer runs are gaps; they are left as they are."""


@dataclass(frozen=True, slots=True)
class Misfit:
    """A converged simulation of one recording.

    Attributes
    ----------
    error : ndarray, shape (N,)
        Simulated less measured output; what it is in masked rows does not matter.
    pulse : ndarray, shape (K,)
        Answer of the output, from the row of the pulse on, to 1 Nm during one sample; zero after the end.
    """

    error: FloatArray
    pulse: FloatArray


def repaired(
    records: Sequence[Record], misfits: Sequence[Misfit], filled: Sequence[Record] | None = None
) -> tuple[Record, ...]:
    """Return the records with unknown torques estimated; those without, or with too many, as they are.

    Parameters
    ----------
    filled : sequence of Record, optional
        The records with unknown torques as they were filled in, where ``records`` have been repaired before.

    ``torque_okay`` stays as it is: an estimate is no reading, and a better model may estimate again.

    Raises
    ------
    BadShape
        If an error has not one value per sample, or holds NaN in unmasked rows.
    """
    began = records if filled is None else filled
    return tuple(_repaired(*each) for each in zip(records, misfits, began, strict=True))


def _repaired(record: Record, misfit: Misfit, filled: Record) -> Record:
    _require_error(record, misfit)
    unknown = ~record.torque_trusted
    rows = np.flatnonzero(_short(any_of(unknown)))
    if rows.size == 0 or rows.size > MOST_UNKNOWN * record.okay.size:
        return record
    added = (record.total_torque_nm - filled.total_torque_nm)[rows]
    correction = _corrections(record, misfit, rows, added)
    parts = unknown[rows] * np.maximum(_step_size(record), np.finfo(float).tiny)
    torque = record.torque_nm.copy()
    torque[rows] += correction[:, np.newaxis] * parts / parts.sum(axis=1, keepdims=True)
    return replace(record, torque_nm=torque)


def _require_error(record: Record, misfit: Misfit) -> None:
    if misfit.error.shape != record.okay.shape or not np.isfinite(misfit.error[record.okay]).all():
        raise BadShape(
            f"recording {record.name}: expected an error of shape {record.okay.shape} with numbers in all unmasked "
            f"rows, came shape {misfit.error.shape} with {np.sum(~np.isfinite(misfit.error))} values that are none. "
            "Give simulated less measured output of this recording."
        )


def _short(unknown: BoolArray) -> BoolArray:
    kept = unknown.copy()
    for begin, end in runs(unknown):
        kept[begin:end] = end - begin <= LONGEST_RUN
    return kept


def _corrections(
    record: Record, misfit: Misfit, rows: np.ndarray[tuple[int], np.dtype[np.intp]], added: FloatArray
) -> FloatArray:
    """Return the most probable correction of the total torque in each of the rows beyond ``added`` [Nm], shape (n,)."""
    n = record.okay.size
    pulse = np.zeros(n)
    length = min(n, misfit.pulse.size)
    pulse[:length] = misfit.pulse[:length]
    answers = np.zeros((n, rows.size), order="F")
    for column, row in enumerate(rows.tolist()):
        answers[row:, column] = pulse[: n - row]
    free = np.column_stack([np.cumsum(pulse), pulse, np.ones(n)])
    free /= np.maximum(np.abs(free).max(axis=0), np.finfo(float).tiny)
    seen = record.okay
    regressors = np.column_stack([answers, free])[seen]
    prior = np.zeros(regressors.shape[1])
    prior[: rows.size] = _noise(misfit.error, seen) ** 2 / _variances(record, rows)
    normal = regressors.T @ regressors
    # The free answers carry no prior; a grain of their own power keeps them apart where they are alike.
    prior[rows.size :] = 1e-9 * np.diag(normal)[rows.size :]
    right = -regressors.T @ misfit.error[seen]
    right[: rows.size] -= prior[: rows.size] * added
    solved = linalg.solve(normal + np.diag(prior), right, assume_a="pos")
    corrections: FloatArray = solved[: rows.size]
    return corrections


def _noise(error: FloatArray, seen: BoolArray) -> float:
    """Return the noise of the output from its error's change from row to row: robust to what wrong torques did."""
    change = np.diff(error)[seen[1:] & seen[:-1]]
    size = 1.4826 * float(np.median(np.abs(change))) / np.sqrt(2.0) if change.size else 0.0
    return max(size, float(np.finfo(float).eps))


def _step_size(record: Record) -> FloatArray:
    """Return the RMS change of each torque from one reading to the next [Nm], shape (M,)."""
    trusted = record.torque_trusted
    change = np.where(trusted[1:] & trusted[:-1], np.diff(record.torque_nm, axis=0), 0.0)
    size: FloatArray = np.sqrt(np.mean(change**2, axis=0))
    return size


def _variances(record: Record, rows: np.ndarray[tuple[int], np.dtype[np.intp]]) -> FloatArray:
    """Return the prior variance of each correction [Nm^2], shape (n,)."""
    total, trusted = record.total_torque_nm, all_of(record.torque_trusted)
    known = np.flatnonzero(trusted)
    place = np.searchsorted(known, rows)
    before = rows - known[np.maximum(place - 1, 0)]
    after = known[np.minimum(place, known.size - 1)] - rows
    away = np.minimum(np.where(before > 0, before, after), np.where(after > 0, after, before))
    of = {int(distance): _variance_over(total, trusted, int(distance)) for distance in np.unique(np.abs(away))}
    return np.array([of[int(distance)] for distance in np.abs(away)])


def _variance_over(total: FloatArray, trusted: BoolArray, distance: int) -> float:
    both = trusted[distance:] & trusted[:-distance]
    change = (total[distance:] - total[:-distance])[both]
    return max(float(np.mean(change**2)) if change.size else 0.0, float(np.finfo(float).eps))
