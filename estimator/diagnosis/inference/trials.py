"""Trials: sets of effects in free simulation, tuned on one part of the data and judged on the other.

The likelihood, which guides the search, asks how well each sample is predicted from those before it. A law of a wrong
form that costs little there may still simulate badly, and noise, drift and random walk whiten what it leaves. So what
is reported is judged in the currency that a user sees: the error of a free run, on samples that no fit has seen.

Each recording is cut into blocks of 0.6 s every 2 s. A set is tuned for the free run between the blocks, and judged by
its squared error inside each block. Two sets are compared block by block; the scatter of the blocks says how sure the
comparison is, whatever the noise is correlated with (a paired comparison; of a ratio to first order: Efron and
Tibshirani, An Introduction to the Bootstrap, 1993, chapter 5).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import t

from estimator.diagnosis.inference.descent import Effort, descended
from estimator.diagnosis.inference.disturbances import reading_noise
from estimator.diagnosis.inference.hypotheses import GRADE, Effects, Hypothesis
from estimator.diagnosis.result import Counted
from estimator.diagnosis.thresholds import THRESHOLDS, Judging, Searching
from estimator.physics.fit import FitResult, in_common, not_fitted, warm_start
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import concurrently
from estimator.physics.problem import Problem, bounds, make_problem
from estimator.signals.record import BoolArray, FloatArray, Record, by_output

COUNTED: Sequence[tuple[float, Counted]] = [
    (row["necessity_from"], Counted(row["right"], row["of"])) for row in THRESHOLDS["counted"]
]
"""Of names whose necessity (its lower end) is from so much up to that of the next row: the count."""

TUNED = Effort(derivatives=2, steps=6)
"""What tuning a set for the free run may cost, from where the likelihood is greatest."""


def quantile(count: int) -> float:
    """Return Student's quantile of so many blocks: how many standard errors a sum of theirs may be off by chance."""
    return float(t.ppf(Judging.SURE, max(count - 1, 1)))


def blocks(record: Record) -> BoolArray:
    """Return which samples are kept out: blocks all along, none at the very ends; shape (N,)."""
    return block_numbers(record) >= 0


def between_blocks(records: Sequence[Record]) -> tuple[BoolArray, ...]:
    """Return which good samples of each recording a fit may see, each of shape (N,)."""
    return tuple(record.okay & ~blocks(record) for record in records)


def block_numbers(record: Record) -> FloatArray:
    """Return the number of the block that each sample is in, -1 between the blocks; shape (N,)."""
    since_s = record.time_s - record.time_s[0]
    scale = min(1.0, float(since_s[-1]) / (Judging.FEWEST_BLOCKS * Judging.EVERY_S))
    every_s, block_s = scale * Judging.EVERY_S, scale * Judging.BLOCK_S
    phase = np.mod(since_s, every_s)
    middle = 0.5 * (every_s - block_s)
    inside = (phase >= middle) & (phase < middle + block_s)
    return np.where(inside, np.floor(since_s / every_s), -1.0)


@dataclass(frozen=True, slots=True)
class Necessity:
    """Which share of the squared error beyond the noise comes back without a law, on samples that no fit has seen."""

    value: float  # estimate, as a share of 1
    least: float  # lower end of its one-sided 95 % interval, by the scatter of the blocks
    counted: Counted  # how many names of such a lower end were there


@dataclass(frozen=True, slots=True)
class Standing:
    """What speaks for one effect of a set."""

    name: str  # key of the catalogue
    necessity: Necessity  # of this effect, within its set
    share: float  # of the re-tuned model's squared free-run error on unseen samples, that comes back without it
    evidence: float  # by which the score rises without it
    alike: Mapping[str, Mapping[str, float]]  # effects that explain as much in its place, with their values there
    objection: str = ""  # why it is not established; "" where it is
    slight: str = ""  # why it is a trace though established; "" where it is a name


@dataclass(frozen=True, slots=True)
class Trial:
    """A set of effects, tuned for the free run on part of the data, and its errors on the rest.

    Attributes
    ----------
    size : int
        How many laws it adds to the nominal model; the smaller of two sets that simulate alike is the better one.
    squares, samples : ndarray, shape (B,)
        Squared free-run error in each block that the fit has not seen, and how many samples count there.
    """

    hypothesis: Hypothesis  # the set, as the likelihood has it
    size: int
    fit: FitResult  # tuned for the free run on samples between the blocks
    squares: FloatArray  # [square of the output's unit]
    samples: FloatArray

    @property
    def effects(self) -> Effects:
        """The effects of the catalogue that it adds."""
        return self.hypothesis.effects

    @property
    def rms(self) -> float:
        """RMS of the free-run error on samples that the fit has not seen [unit of the output]."""
        return math.sqrt(float(self.squares.sum()) / max(float(self.samples.sum()), 1.0))

    def excess(self, noise: float) -> FloatArray:
        """Return the squared error of each block beyond that of a noise [unit of the output], shape (B,)."""
        return self.squares - noise**2 * self.samples

    def clearly_beats(self, other: Trial) -> bool:
        """Tell whether it leaves less error than another, by more than the scatter of the blocks, at 95 %."""
        gained = other.squares - self.squares
        scatter = math.sqrt(gained.size) * float(np.std(gained, ddof=1)) if gained.size > 1 else math.inf
        return float(gained.sum()) > quantile(gained.size) * scatter

    def is_far_behind(self, best: Trial) -> bool:
        """Tell whether another set clearly leaves so much less that no search need begin from this one."""
        return necessity(best, self, noise_of(best.hypothesis)).least >= Judging.LEAST_NECESSITY

    def beats(self, other: Trial) -> bool:
        """Tell whether another set need not be considered: one of as few laws, or of fewer, simulates better.

        Of two sets of as many laws one must clearly be better; more laws that leave as much are not needed at all.
        """
        if self.size < other.size:
            return float(self.squares.sum()) <= float(other.squares.sum())
        return self.size == other.size and self.clearly_beats(other)


def necessity(whole: Trial, without: Trial, noise: float) -> Necessity:
    """Return how much a set needs what another one lacks: ``1 - excess(whole) / excess(without)``.

    0 where the set without leaves no more than the noise, or no more than the whole one. The scatter is that of a ratio
    of two sums over blocks, to first order.
    """
    left, before = whole.excess(noise), without.excess(noise)
    total = float(before.sum())
    if total <= 0.0 or float(left.sum()) >= total:
        return Necessity(0.0, 0.0, counted_from(0.0))
    ratio = max(float(left.sum()), 0.0) / total
    scatter = math.sqrt(left.size) * float(np.std(left - ratio * before, ddof=1)) / total if left.size > 1 else math.inf
    least = max(1.0 - ratio - quantile(left.size) * scatter, 0.0)
    return Necessity(1.0 - ratio, least, counted_from(least))


def counted_from(least: float) -> Counted:
    """Return how many names whose necessity had such a lower end were there."""
    return next((count for begin, count in reversed(COUNTED) if least >= begin), COUNTED[0][1])


@dataclass
class Trials:
    """The sets that were tried in free simulation; each is tuned once."""

    model: DrivelineModel  # nominal
    _tried: dict[Effects, Trial] = field(default_factory=dict)  # by set

    @property
    def all(self) -> Mapping[Effects, Trial]:
        """Return every set that was tried."""
        return dict(self._tried)

    def of(self, hypotheses: Sequence[Hypothesis]) -> list[Trial]:
        """Return the trial of each set, the smaller ones first: a larger one begins from these, too."""
        for size in sorted({len(each.effects) for each in hypotheses}):
            new = [each for each in hypotheses if len(each.effects) == size and self._is_new(each)]
            for trial in concurrently(self._tuned, new):
                self._tried[trial.effects] = trial
        return sorted((self._tried[each.effects] for each in hypotheses), key=lambda trial: trial.size)

    def one(self, hypothesis: Hypothesis) -> Trial:
        """Return the trial of one set."""
        return self.of([hypothesis])[0]

    def is_worth_adding(self, larger: Hypothesis, smaller: Hypothesis) -> bool:
        """Tell whether a law that makes a set more probable surely makes its free run better, by more than a little.

        What the form of a law leaves is predicted a little better by nearly every further law; a search that follows
        the likelihood alone wanders among sets of these.
        """
        if larger.effects <= smaller.effects:  # of the same laws, or fewer, a better fit
            return True
        one, other = self.of([smaller, larger])
        needed = necessity(other, one, noise_of(larger))
        return needed.value >= Searching.WORTH_ADDING and needed.least > 0.0

    def leaves_a_trace_at_most(self, current: Hypothesis, nothing: Hypothesis, noise: float) -> bool:
        """Tell whether what a set leaves beyond a noise is so little that no further law could be more than a trace."""
        if not current.effects:
            return False
        without, its = self.one(nothing), self.one(current)
        return float(its.excess(noise).sum()) < Judging.LEAST_SHARE * float(without.excess(noise).sum())

    def as_good(self, smaller: Sequence[Hypothesis], whole: Hypothesis) -> Hypothesis | None:
        """Return the set of fewer laws that simulates as well as the whole one, the best of several."""
        if not smaller:
            return None
        best = self.one(whole)
        found = [each for each in self.of(smaller) if each.beats(best) and each.hypothesis.is_plausible]
        return min(found, key=lambda each: each.rms).hypothesis if found else None

    def worth_beginning_from(self, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return the sets of which none clearly leaves so much more than the best that no search need begin there."""
        trials = self.of(hypotheses)
        best = min(trials, key=lambda each: each.rms)
        return [each.hypothesis for each in trials if not each.is_far_behind(best)]

    def _is_new(self, hypothesis: Hypothesis) -> bool:
        known = self._tried.get(hypothesis.effects)
        return known is None or known.hypothesis is not hypothesis

    def _tuned(self, hypothesis: Hypothesis) -> Trial:
        within = [trial for effects, trial in self._tried.items() if effects < hypothesis.effects]
        nearest = sorted(within, key=lambda trial: (-trial.size, trial.fit.squares))[:1]
        return tried(hypothesis, self.model, size_of(hypothesis.effects), [trial.fit for trial in nearest])


def size_of(effects: Effects) -> int:
    """Return for how many laws a set counts: a load's free course follows whatever is slow, as several laws would."""
    return len(effects) + (Judging.COURSE - 1) * (GRADE in effects)


def tried(hypothesis: Hypothesis, model: DrivelineModel, size: int, subsets: Sequence[FitResult] = ()) -> Trial:
    """Tune a hypothesis for the free run between the blocks and return its errors inside these.

    It begins from where the likelihood is greatest, and from the tuned fits of some of its ``subsets``: what a subset
    can do, it can do too.
    """
    of = hypothesis.result.problem
    use = between_blocks(of.records)
    own = [basis.own for basis in of.local]
    is_free = GRADE in hypothesis.effects
    problem = make_problem(model, of.records, of.shared, own=own, profile=is_free, use=use, grid=of.grid)
    likely = warm_start(problem, hypothesis.result)
    fits = [_descended(problem, x) for x in (likely, *(_continued(problem, likely, subset) for subset in subsets))]
    best = min(fits, key=lambda each: each.squares)
    squares, samples = inside_blocks(best)
    return Trial(hypothesis, size, best.without_derivative(), squares, samples)


def _descended(problem: Problem, x: FloatArray) -> FitResult:
    low, high = bounds(problem)
    initial = not_fitted(problem, np.clip(x, low, high))
    rms = initial.rms
    return descended(initial, lambda errors: errors / rms, TUNED)


def _continued(problem: Problem, likely: FloatArray, subset: FitResult) -> FloatArray:
    """Return unknowns as a subset's fit left them, those that it lacks where the likelihood is greatest."""
    x = likely.copy()
    columns, taken, ratio = in_common(problem, subset.problem)
    x[columns] = subset.x[taken] / ratio
    return x


def inside_blocks(result: FitResult) -> tuple[FloatArray, FloatArray]:
    """Return the squared error and the count of samples of every block of every recording, shapes (B,)."""
    squares, samples = [], []
    for record, output in zip(result.problem.records, result.outputs, strict=True):
        number = block_numbers(record)
        counts = record.okay & (number >= 0)
        error = np.where(counts, output - np.where(counts, record.output, 0.0), 0.0)
        for block in np.unique(number[counts]):
            inside = counts & (number == block)
            squares.append(float(error[inside] @ error[inside]))
            samples.append(float(inside.sum()))
    return np.array(squares), np.array(samples)


def noise_of(hypothesis: Hypothesis) -> float:
    """Return the reading's noise, white and coloured, over all outputs [unit of the output]."""
    problem = hypothesis.result.problem
    counts = [sum(int(use.sum()) for use in problem.use[part]) for part in by_output(problem.records)]
    return math.sqrt(float(np.average(reading_noise(hypothesis.sizes) ** 2, weights=counts)))
