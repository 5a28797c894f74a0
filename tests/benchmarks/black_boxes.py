"""``python -m tests.benchmarks.black_boxes REC... --model MODEL``: a law without a name against three black boxes.

All are fitted to the same samples and judged in free run on the same others, which no fit and no choice has seen: the
blocks of each recording by which a law is judged (`estimator.diagnosis.tables`). Black boxes begin from the first
readings of a recording; the line has its load and its first state estimated on the samples that fit.

- Box-Jenkins of order 4 (Box and Jenkins, Time Series Analysis): the product's own, one model for each recording;
- polynomial NARX: products of four past outputs and torques to the third degree, chosen by orthogonal forward
  regression (Billings, Nonlinear System Identification, 2013), as many as simulate the choosing blocks best;
- sparse regression: the same products to the second degree with signs and sizes of both, by least squares with
  thresholds in turn (Brunton, Proctor and Kutz, PNAS 113, 2016), the threshold that simulates them best.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np

from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import all_good_samples
from estimator.diagnosis.preconditions.prepare import prepare
from estimator.diagnosis.segments import as_slow_as_needed
from estimator.diagnosis.table_curves import Masks, rms_over
from estimator.diagnosis.tables import best_table, blocks_of
from estimator.diagnosis.thresholds import Curves
from estimator.errors import EstimatorError
from estimator.identification.linear_model import Orders
from estimator.identification.offline.fits import fit_box_jenkins
from estimator.physics.fit import fit
from estimator.physics.model import DrivelineModel
from estimator.signals.record import FloatArray, IntArray, Record
from hil.config.model_file import read_model_for_recordings
from hil.recording import read_records

LAGS = 4
MOST_TERMS = 25
THRESHOLDS = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 0.0)
"""Shares of the largest normalised coefficient below which one is dropped."""

RUNAWAY = 100.0  # spreads of the output beyond which a free run has run away


@dataclass(frozen=True)
class Split:
    """Recordings, and which of their samples fit, choose and judge."""

    records: Sequence[Record]
    fitting: Masks
    choosing: Masks
    unseen: Masks

    @property
    def scale(self) -> FloatArray:
        """Size of the output and of the torque in use."""
        sizes = [np.concatenate([each(r)[r.okay] for r in self.records]) for each in (lambda r: r.output, torque_of)]
        return np.array([np.std(size) or 1.0 for size in sizes])


def torque_of(record: Record) -> FloatArray:
    """Return what drives a recording: the torques, or the motion that a bench imposes on a joint."""
    return record.total_torque_nm if record.imposed is None else record.imposed


def split(records: Sequence[Record]) -> Split:
    """Share the samples out as the search for a law does."""
    use = [record.okay for record in records]
    unseen, choosing = (blocks_of(records, use, which) for which in (Curves.UNSEEN, Curves.CHOOSING))
    fitting = tuple(u & ~a & ~b for u, a, b in zip(use, unseen, choosing, strict=True))
    return Split(records, fitting, choosing, unseen)


def rms(outputs: Sequence[FloatArray], records: Sequence[Record], masks: Masks) -> float:
    """Return the RMS of free runs over some samples; infinite where one has run away."""
    rows = zip(outputs, records, masks, strict=True)
    errors = np.concatenate([(output - record.output)[mask] for output, record, mask in rows])
    return float(np.sqrt(np.mean(errors**2))) if np.isfinite(errors).all() else np.inf


def box_jenkins(of: Split) -> float:
    """Return the error of a Box-Jenkins model of order 4 of each recording."""
    seen = [
        replace(record, okay=record.okay & ~unseen, torque_nm=torque_of(record)[:, np.newaxis], imposed=None)
        for record, unseen in zip(of.records, of.unseen, strict=True)
    ]
    outputs = [fit_box_jenkins(record, Orders(LAGS, LAGS, 1)).simulate(torque_of(record)) for record in seen]
    return rms(outputs, of.records, of.unseen)


def past(outputs: FloatArray, torque: FloatArray) -> FloatArray:
    """Return the past values of each sample from the fifth on, shape (N - 4, 8)."""
    n = outputs.size
    columns = [signal[LAGS - lag : n - lag] for signal in (outputs, torque) for lag in range(1, LAGS + 1)]
    return np.column_stack(columns)


def products(degree: int) -> IntArray:
    """Return which past values each product up to a degree multiplies, shape (P, degree); number 0 stands for 1."""
    return np.array(list(combinations_with_replacement(range(2 * LAGS + 1), degree)))


@dataclass(frozen=True)
class Library:
    """Functions of the past values: products, and signs and sizes where they are wanted."""

    factors: IntArray  # of ``products``
    bent: bool

    def columns(self, past_values: FloatArray) -> FloatArray:
        """Return the functions as columns, of past values of shape (N, 8)."""
        with_one = np.column_stack([np.ones(past_values.shape[0]), past_values])
        found = [np.prod(with_one[:, self.factors], axis=2)]
        if self.bent:
            last = past_values[:, [0, LAGS]]
            found += [np.tanh(last / 0.02), np.abs(last), last * np.abs(last)]
        return np.hstack(found)


@dataclass(frozen=True)
class Regression:
    """The equations of one step ahead of all samples that fit, in scaled signals."""

    of: Split
    library: Library

    def signals(self, record: Record) -> tuple[FloatArray, FloatArray]:
        output = np.interp(record.time_s, record.time_s[record.okay], record.output[record.okay])
        return output / self.of.scale[0], torque_of(record) / self.of.scale[1]

    def equations(self) -> tuple[FloatArray, FloatArray]:
        """Return columns and targets."""
        rows, targets = list[FloatArray](), list[FloatArray]()
        for record, fitting in zip(self.of.records, self.of.fitting, strict=True):
            output, torque = self.signals(record)
            windows = np.lib.stride_tricks.sliding_window_view(fitting, LAGS + 1).all(axis=1)
            rows.append(self.library.columns(past(output, torque))[windows])
            targets.append(output[LAGS:][windows])
        return np.vstack(rows), np.concatenate(targets)

    def free_runs(self, chosen: IntArray, weights: FloatArray) -> list[FloatArray]:
        """Simulate every recording from its first readings."""
        found = []
        for record in self.of.records:
            measured, torque = self.signals(record)
            output = measured.copy()
            for k in range(LAGS, output.size):
                now = past(output[k - LAGS : k + 1], torque[k - LAGS : k + 1])
                output[k] = self.library.columns(now)[0, chosen] @ weights
                if not abs(output[k]) < RUNAWAY:
                    output[k:] = np.inf
                    break
            found.append(output * self.of.scale[0])
        return found

    def best(self, models: Iterator[tuple[IntArray, FloatArray]]) -> float:
        """Return the error on unseen samples of the model that simulates the choosing ones best."""
        tried = [self.free_runs(*model) for model in models]
        chosen = min(tried, key=lambda runs: rms(runs, self.of.records, self.of.choosing))
        return rms(chosen, self.of.records, self.of.unseen)


def forward(columns: FloatArray, targets: FloatArray) -> Iterator[tuple[IntArray, FloatArray]]:
    """Yield models of ever more columns, each the one that takes most of what those before have left."""
    left, rest, chosen = targets.copy(), columns / np.linalg.norm(columns, axis=0), list[int]()
    for _ in range(min(MOST_TERMS, columns.shape[1])):
        sizes = np.linalg.norm(rest, axis=0)
        gains = np.where(sizes > 1e-6, np.abs(rest.T @ left) / np.maximum(sizes, 1e-6), 0.0)
        gains[chosen] = 0.0
        chosen.append(int(np.argmax(gains)))
        along = rest[:, chosen[-1]] / sizes[chosen[-1]]
        left = left - along * (along @ left)
        rest = rest - np.outer(along, along @ rest)
        if len(chosen) % 3 == 1:
            yield np.array(chosen), np.linalg.lstsq(columns[:, chosen], targets, rcond=None)[0]


def thresholded(columns: FloatArray, targets: FloatArray) -> Iterator[tuple[IntArray, FloatArray]]:
    """Yield the least squares with ever smaller thresholds."""
    sizes = np.linalg.norm(columns, axis=0)
    for threshold in THRESHOLDS:
        kept = np.arange(columns.shape[1])
        weights = np.linalg.lstsq(columns / sizes, targets, rcond=None)[0]
        for _ in range(10):
            large = np.abs(weights) >= threshold * np.abs(weights).max()
            if large.all():
                break
            kept = kept[large]
            weights = np.linalg.lstsq(columns[:, kept] / sizes[kept], targets, rcond=None)[0]
        yield kept, weights / sizes[kept]


def narx(of: Split) -> float:
    """Return the error of the polynomial NARX."""
    regression = Regression(of, Library(products(3), False))
    return regression.best(forward(*regression.equations()))


def sparse(of: Split) -> float:
    """Return the error of the sparse regression."""
    regression = Regression(of, Library(products(2), True))
    return regression.best(thresholded(*regression.equations()))


def of_line(of: Split, model: DrivelineModel) -> tuple[float, float, str]:
    """Return the errors of the re-tuned line and of it with the best law, and the law's place."""
    fits = Fits(model, of.records, all_good_samples(of.records), ())
    hypothesis = fits.nothing()
    found = best_table(hypothesis, model)
    if found is not None:
        return found.law.rms_before, found.law.rms_after, found.law.place
    whole = hypothesis.result.first_outputs()
    seen = tuple(record.okay & ~unseen for record, unseen in zip(of.records, of.unseen, strict=True))
    retuned = fit(replace(whole.problem, use=seen), whole.x)
    before = rms_over(retuned.problem, retuned.outputs, of.unseen)
    return before, before, ""


def compared(records: Sequence[Record], model: DrivelineModel) -> str:
    """Return a line of Markdown: the errors on unseen samples of all that were fitted."""
    of = split(as_slow_as_needed(prepare(records, model).records, model))
    before, after, place = of_line(of, model)
    cells = [f"{before:.4g}", f"{after:.4g} ({place})" if place else "none"]
    for each in (box_jenkins, narx, sparse):
        try:
            cells.append(f"{each(of):.4g}")
        except EstimatorError as error:
            cells.append(f"refused: {error}")
    return f"| {', '.join(record.name for record in records)} | {' | '.join(cells)} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare on the recordings that are given; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.black_boxes", description="See the module.")
    parser.add_argument("recordings", nargs="+", type=Path)
    parser.add_argument("--model", required=True, type=Path)
    options = parser.parse_args(arguments)
    file = read_model_for_recordings(options.model)
    records = read_records(options.recordings, file.signals, file.on_bench)
    sys.stdout.write("| recordings | re-tuned | with a law | Box-Jenkins | NARX | sparse |\n" + "| --- " * 6 + "|\n")
    sys.stdout.write(f"{compared(records, file.model)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
