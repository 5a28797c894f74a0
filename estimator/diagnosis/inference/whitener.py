"""Kalman filters that turn a fit's errors into innovations under a noise model, all outputs of a recording together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import partial

import numpy as np

from estimator.diagnosis.inference.disturbances import Line, line_of
from estimator.diagnosis.line.motion import LASTS, FormPlace, form_changes
from estimator.diagnosis.line.whitening import Gains, Terms, fill_gains, innovate, terms_of
from estimator.physics.fit import FitResult
from estimator.physics.problem import Rows
from estimator.signals.correlation import stand_in_variance
from estimator.signals.outputs import by_output
from estimator.signals.record import BoolArray, FloatArray


class Size(IntEnum):
    """Places in the vector of a noise model: natural logarithms of sizes and times.

    The noise of each further output's reading follows: its ``WHITE``, ``COLOURED`` and ``COLOUR_S``.
    """

    WHITE = 0
    COLOURED = 1
    COLOUR_S = 2
    TORQUE = 3
    DRIFT = 4
    DRIFT_S = 5
    WALK = 6
    FORM = 7


READING = 3
"""How many sizes are of an output's reading."""


def of_first(sizes: FloatArray) -> FloatArray:
    """Return the noise model of the first output alone, shape (8,)."""
    return sizes[: len(Size)]


def readings(sizes: FloatArray) -> FloatArray:
    """Return the sizes of each output's reading, shape (C, 3), of a noise model of C outputs."""
    return np.concatenate([sizes[:READING], sizes[len(Size) :]]).reshape(-1, READING)


@dataclass(frozen=True, slots=True)
class Whitener:
    """Kalman filters for recordings: a linear map of their errors to innovations of variance 1.

    Attributes
    ----------
    f, h : Terms
        Of the transition, shape (m, m), and of how the outputs show the state, shape (C, m).
    gains : tuple of Gains
        Of each recording.
    use : tuple of ndarray of bool, shape (N_i, C)
    rows : tuple of Rows
        Where the samples of each recording that count stand among all, its outputs in turn.
    """

    f: Terms
    h: Terms
    gains: tuple[Gains, ...]
    use: tuple[BoolArray, ...]
    rows: tuple[Rows, ...]

    def __call__(self, stacked: FloatArray) -> FloatArray:
        """Return the innovations of stacked errors of the samples that count, shape (R,) or (R, K)."""
        columns = np.atleast_2d(stacked.T).T
        found = np.empty(columns.shape)
        for i, rows in enumerate(self.rows):
            found[rows] = self.part(i, columns[rows])
        return found.reshape(stacked.shape)

    def part(self, index: int, columns: FloatArray) -> FloatArray:
        """Return the same of one recording alone, shape (R_i, K)."""
        found = np.array(columns, order="C")
        innovate(self.f, self.h, self.gains[index], self.use[index], found)
        return found

    @property
    def logs(self) -> FloatArray:
        """Logarithms of the innovations' standard deviations, stacked, shape (R,)."""
        found = np.empty(sum(int(use.sum()) for use in self.use))
        for rows, gains, use in zip(self.rows, self.gains, self.use, strict=True):
            found[rows] = np.log(gains.spread.T[use.T])
        return found

    def minus_twice_log(self, innovations: FloatArray) -> float:
        """Return minus twice the log-likelihood of stacked innovations, but for a constant."""
        return 2.0 * float(self.logs.sum()) + float(innovations @ innovations)


def whitener_of(result: FitResult, sizes: FloatArray) -> Whitener:
    """Return the filters of a fit's errors under a noise model, ``sizes`` as `Size` says."""
    return whitening_of(result)(sizes)


def whitening_of(result: FitResult) -> Callable[[FloatArray], Whitener]:
    """Return a function from a noise model to the filters of a fit's errors."""
    problem = result.problem
    parts, firsts = by_output(problem.records), problem.records[: len(problem.bases)]
    use = [np.zeros((record.time_s.size, len(parts)), dtype=np.bool_) for record in firsts]
    for output, part in enumerate(parts):
        for i in range(part.start, part.stop):
            use[problem.leads[i]][:, output] = problem.use[i]
    unread = [stand_in_variance(record) for record in firsts]
    changes = changes_of(result)
    return partial(whitener, line_of(result), firsts[0].sample_time_s, use, unread, problem.rows, changes=changes)


def changes_of(result: FitResult) -> tuple[FloatArray, ...]:
    """Return how much laws change in each recording at each place, shape (3, N_i); nothing where none does."""
    each = tuple(form_changes(result, i) for i in range(len(result.problem.bases)))
    return each if any(change.any() for change in each) else ()


def whitener(
    line: Line,
    period_s: float,
    use: Sequence[BoolArray],
    unread: Sequence[FloatArray],
    rows: Sequence[Rows],
    sizes: FloatArray,
    changes: Sequence[FloatArray] = (),
) -> Whitener:
    """Return the filters of recordings under a noise model, ``sizes`` as `Size` says.

    Parameters
    ----------
    use : sequence of ndarray of bool, shapes (N_i, C)
    unread : sequence of ndarray, shapes (N_i,)
        Variance of each recording's torque where it was not read.
    rows : sequence of Rows
        See `Whitener`.
    changes : sequence of ndarray, shapes (3, N_i)
        By how much laws change at each place [Nm]; empty where none does (``form_error``).
    """
    torque, drift, drift_s, walk, share = np.exp(sizes[READING : len(Size)])
    white, coloured, colour_s = np.exp(readings(sizes)).T
    count, n = line.h.shape
    off = [place for place in FormPlace if any(change[place].any() for change in changes)]
    m = n + 2 + count + len(off)  # drift, walk, coloured of each output, laws off by their forms
    forms = n + 2 + count + np.arange(len(off))
    colours = n + 2 + np.arange(count)
    f, q, prior, h = np.zeros((m, m)), np.zeros((m, m)), np.zeros((m, m)), np.zeros((count, m))
    kept_drift, kept_colour = np.exp(-period_s / drift_s), np.exp(-period_s / colour_s)
    f[:n, :n], f[:n, n], f[:n, n + 1] = line.f, line.torque, line.load
    f[n, n], f[n + 1, n + 1], f[colours, colours] = kept_drift, 1.0, kept_colour
    q[:n, :n] = torque**2 * np.outer(line.torque, line.torque)
    q[n, n], q[n + 1, n + 1] = drift**2 * (1.0 - kept_drift**2), walk**2 * period_s
    q[colours, colours] = coloured**2 * (1.0 - kept_colour**2)
    prior[n, n], prior[colours, colours] = drift**2, coloured**2
    h[:, :n], h[:, n + 1], h[np.arange(count), colours] = line.h, line.direct, 1.0
    at_input = np.zeros((1 + len(off), m))
    at_input[0, :n], at_input[1:, forms] = line.torque, np.eye(len(off))
    kept_form = np.exp(-1.0 / LASTS)
    f[forms, forms] = kept_form
    for place, state in zip(off, forms, strict=True):
        f[:n, state] = (line.torque, line.load, line.shaft)[place]
    terms = terms_of(f)
    seen: dict[tuple[bytes, bytes], Gains] = {}
    each = []
    for i, (mask, own) in enumerate(zip(use, unread, strict=True)):
        of_forms = [(1.0 - kept_form**2) * (share * changes[i][place]) ** 2 for place in off]
        variance = np.column_stack([own, *of_forms])
        key = mask.tobytes(), variance.tobytes()
        if key not in seen:
            seen[key] = Gains(np.empty((*mask.shape, m)), np.empty((*mask.shape, count)), np.empty(mask.shape))
            fill_gains(terms, h, q, white**2, prior, mask, at_input, variance, seen[key])
        each.append(seen[key])
    return Whitener(terms, terms_of(h), tuple(each), tuple(use), tuple(rows))
