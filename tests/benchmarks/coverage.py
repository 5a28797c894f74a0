"""``python -m tests.benchmarks.coverage --seeds A..B``: how often 95 % intervals hold the truth, the name being known.

Worlds of the demo's kinds (its effects in turn) from the truth simulator, whose laws have forms of their own.
What is there is fitted without a search, so that a rate is of the intervals alone. Two of them are compared: what a
diagnosis reports, and the likelihood's own, from the slope at a point. A value at the edge of its tolerance is not
counted. ``width`` is the median of the one over the other.
"""

import argparse
import json
import math
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.acquisition.chain import with_faults_compensated
from estimator.diagnosis.covariance import Z95, estimate_of, reported_covariance
from estimator.diagnosis.inference.figures import FreeRuns, on_recordings
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import all_good_samples, open_hypotheses
from estimator.diagnosis.inference.remainder import tests
from estimator.signals.record import Record
from hil.config.model_file import read_model_for_recordings
from hil.proof.make_case import write_shown
from hil.proof.sealed_rig import CONCEALED
from hil.proof.truth.case import Case, make_case
from hil.proof.truth.specimen import EFFECTS, NOTHING
from hil.recording import read_records
from tests.benchmarks.ratios import table
from tests.campaigns.worlds import parse_seeds

EDGE = 1e-6  # distance from a bound, in scaled unknowns, from which a value is at it


@dataclass(frozen=True, slots=True)
class Value:
    """One value of a fit: its error, and the standard deviations it is reported with [scaled unknowns]."""

    kind: str  # effect that is there
    error: float
    at_point: float  # standard deviation by the likelihood, or by correlated errors
    reported: float

    def is_held(self, spread: float) -> bool:
        """Tell whether an interval of such a standard deviation holds the truth."""
        return abs(self.error) <= Z95 * spread


def values(seed: int) -> Iterator[Value]:
    """Yield the values of one world."""
    case = make_case(CONCEALED[seed % len(CONCEALED)], seed)
    runs = _fitted(case)
    truth = case.specimen.truth()
    before = reported_covariance(runs.believed.white if runs.is_whole else runs.after)
    estimate = estimate_of(runs.believed, runs.is_whole, runs.after)
    result, now = estimate.fit, estimate.covariance
    for i, shared in enumerate(result.problem.shared):
        true = _true(shared.effect, shared.name, json.loads(json.dumps(truth)))
        x = float(result.x[i])
        if true is not None and min(x - shared.low, shared.high - x) > EDGE:
            spreads = (math.sqrt(float(each[i, i])) for each in (before, now))
            yield Value(case.specimen.effect, x - true / shared.scale, *spreads)


def _true(effect: str, name: str, truth: dict[str, dict[str, dict[str, float]]]) -> float | None:
    if not effect:
        return truth["true"].get(name)  # type: ignore[return-value]
    entry = EFFECTS.get(effect)
    return entry.should_be(name, truth["hidden"][effect], truth["true"]) if entry and name in entry.fitted else None


def _fitted(case: Case) -> FreeRuns:
    with tempfile.TemporaryDirectory(prefix="hil-coverage-") as place:
        write_shown(case, Path(place))
        file = read_model_for_recordings(Path(place) / "model.toml")
        records: Sequence[Record] = read_records(sorted(Path(place).glob("run_*.csv")), file.signals, file.on_bench)
    chain, name = with_faults_compensated(records), case.specimen.effect
    fits = Fits(file.model, chain.records, all_good_samples(chain.records), open_hypotheses(file.model, records)[0])
    best = fits.nothing()
    if name != NOTHING:
        rough = fits.added(best, name, fits.starts(best, name))
        best = fits.finish(rough or best, best)
    is_whole = not any(test.failed for test in tests(best))
    after = on_recordings(best, file.model, chain.separated, is_whole)
    return FreeRuns(chain, None, best, is_whole, after, after, math.nan, math.nan)  # type: ignore[arg-type]


def _line(title: str, group: Sequence[Value]) -> tuple[str, ...]:
    held = [sum(each.is_held(spread(each)) for each in group) for spread in (_at_point, _reported)]
    width = float(np.median([each.reported / each.at_point for each in group]))
    return (title, str(len(group)), *(f"{each / len(group):.1%}" for each in held), f"{width:.2f}")


def _at_point(value: Value) -> float:
    return value.at_point


def _reported(value: Value) -> float:
    return value.reported


def main() -> int:
    """Count, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=parse_seeds, required=True)
    asked = parser.parse_args()
    with threadpool_limits(1, user_api="blas"):
        found = [value for seed in asked.seeds for value in values(seed)]
    kinds = sorted({each.kind for each in found})
    lines = [_line(kind, [each for each in found if each.kind == kind]) for kind in kinds]
    head = ("what is there", "values", "held by the slope at a point", "held as reported (95 %)", "width")
    sys.stdout.write(table(head, [*lines, _line("all", found)]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
