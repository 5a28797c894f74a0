"""Change detection: has the resonance left where it was, at a stated rate of false alarms.

A reference model, the estimate once it has settled, runs free alongside the driveline. If the natural frequency moves
by delta, its error is to first order ``e = w + psi delta``, with psi the sensitivity of the output to that frequency
(:mod:`poles`; e and psi are both taken in steps). Every second the samples come to one deviation::

    d = sum psi e / sum psi^2

the score of that change over its information (the local approach: M. Basseville, I. V. Nikiforov, Detection of Abrupt
Changes, Prentice Hall 1993, chapter 8). A tracked parameter would tell the same later: the estimate takes seconds to
move, the score has it in the first block.

No noise model is believed: level and spread of d are those of :attr:`WatchSettings.reference_blocks` blocks seen
before, a period of the PRBS and more, so that what the model lacks, which the PRBS repeats, is part of them. With the
information p = sum psi^2 of a block, x = d sqrt(p) has one spread s for every p as long as noise is what spreads it;
what the model lacks spreads d instead. Which of the two it was is not known: the variance of d is the larger of both,
``s^2 max(1/p, 1/p_usual)``. The threshold follows from the rate of false alarms (:mod:`alarm`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from estimator.compiled import compiled
from estimator.identification.linear_model import ComplexArray, Orders
from estimator.identification.modes.modes import LIGHTLY_DAMPED
from estimator.identification.online.recursive import Trajectory
from estimator.identification.tracking.alarm import Alarm, Level, TrackingState, threshold_for
from estimator.identification.tracking.follow import NA, NB, NK, shift_in
from estimator.identification.tracking.poles import (
    DAMPING,
    FREQUENCY_HZ,
    LAST,
    N_THROUGH,
    dominant,
    pass_torque,
    residue,
    sensitivity,
    squared,
    weight_of,
)
from estimator.signals.record import BoolArray, FloatArray, IntArray
from estimator.signals.settings import Requirement, is_positive, require

HOUR_S = 3600.0

# Rows of `past`: newest value first.
OUTPUT, INPUT = 0, 1

# Places in `mode`: the reference's resonance.
REFERENCE_HZ = 0  # 0 while there is no reference
POLE_RE, POLE_IM, WEIGHT_RE, WEIGHT_IM = 1, 2, 3, 4
ERROR, OUTPUT_THEN = 5, 6  # of the last sample; NaN where it was not good
N_MODE = 7

# Places in `score`: sums over the present block.
GOOD = 0  # samples that were good, and so was the one before
PSI_E = 1  # sum of psi and the error's step
PSI_2 = 2  # sum of psi^2
ERROR_2, OUTPUT_2 = 3, 4  # sums of the squared steps of error and output
N_SCORE = 5

CANDIDATES = 5
"""Estimates that the reference is chosen from, one a block: a single one may be of a bad moment, when a spare pair of
poles passes by the resonance."""


@dataclass(frozen=True, slots=True)
class Spread:
    """How blocks scatter."""

    of_x: float  # standard deviation s of d sqrt(p)
    usual: float  # mean information of the blocks it is known from

    def variance(self, information: float) -> float:
        """Return the variance of the deviation that a block of so much information gives [Hz^2]."""
        return self.of_x**2 * max(1.0 / information, 1.0 / self.usual)


@dataclass(frozen=True, slots=True)
class Baseline:
    """Mean deviation of some blocks, weighted by their information."""

    level_hz: float  # their mean [Hz]
    information: float  # of all of them

    @classmethod
    def of(cls, deviation_hz: FloatArray, information: FloatArray) -> Baseline:
        """Take the mean of blocks, each array of shape (n,)."""
        total = float(information.sum())
        return cls(float(information @ deviation_hz) / total, total)

    def statistic(self, deviation_hz: float, information: float, tolerated_hz: float, spread: Spread) -> float:
        """Return how far a block is from here, beyond what is tolerated, in standard deviations."""
        away = deviation_hz - self.level_hz
        beyond = np.sign(away) * max(abs(away) - tolerated_hz, 0.0)
        return float(beyond / np.sqrt(spread.variance(information) + spread.of_x**2 / self.information))


def spread_of(number: FloatArray, deviation_hz: FloatArray, information: FloatArray) -> Spread:
    """Return how blocks scatter about a straight line over their numbers, each array of shape (n,), n of 3 or more.

    A line, since a resonance that drifts while it is learnt would be taken for one that scatters.
    """
    mean = (information @ number) / information.sum()
    level = (information @ deviation_hz) / information.sum()
    slope = (information @ ((number - mean) * (deviation_hz - level))) / (information @ (number - mean) ** 2)
    rest = deviation_hz - level - slope * (number - mean)
    return Spread(float(np.sqrt(information @ rest**2 / (number.size - 2))), float(information.mean()))


@dataclass(frozen=True, slots=True)
class WatchSettings:
    """How a change is watched for."""

    false_alarms_per_hour: float = 0.1  # of a drive that does not change
    smallest_change: float = 0.01  # A change up to this share of the resonance counts as none
    block_s: float = 1.0  # length of a block, whose mean is one value of the statistic [s]
    reference_blocks: int = 21  # blocks that level and spread are learnt from
    baseline_blocks: int = 7  # blocks that the level is learnt from after an alarm
    settling_s: float = 16.0  # excited time from a start or alarm until the reference is taken [s]
    fewest_share: float = 0.8  # A block with a smaller share of usable samples is left out

    def __post_init__(self) -> None:
        share, blocks, smallest = self.fewest_share, self.reference_blocks, self.smallest_change
        require(
            "watch",
            (
                Requirement("smallest_change", smallest, 0 <= smallest < 1, "a share from 0 to 1"),
                Requirement("block_s", self.block_s, is_positive(self.block_s), "a length above 0 s"),
                Requirement("reference_blocks", blocks, blocks >= 3, "3 or more"),
                Requirement("baseline_blocks", self.baseline_blocks, self.baseline_blocks >= 1, "1 or more"),
                Requirement("settling_s", self.settling_s, self.settling_s >= 0, "0 s or more"),
                Requirement("fewest_share", share, 0 < share <= 1, "a share above 0 and at most 1"),
            ),
        )

    def block_samples(self, sample_time_s: float) -> int:
        """Return the samples of a block at a sampling period [s]."""
        return max(round(self.block_s / sample_time_s), 1)

    def threshold(self, blocks: int, sample_time_s: float) -> float:
        """Return the threshold next to a level learnt from so many blocks."""
        per_hour = HOUR_S / (self.block_samples(sample_time_s) * sample_time_s)
        return threshold_for(self.false_alarms_per_hour, per_hour, blocks, self.reference_blocks - 2)


@compiled
def take_reference(
    theta: FloatArray,
    structure: IntArray,
    sample_time_s: float,
    band: FloatArray,
    work: FloatArray,
    roots: ComplexArray,
    mode: FloatArray,
    through: FloatArray,
) -> None:
    """Take an estimate as the reference: its resonance and how the error answers a change of it; none without one."""
    na = structure[NA]
    mode[:] = 0.0
    mode[ERROR] = np.nan
    through[:LAST] = 0.0
    found = dominant(theta, na, structure[NK], sample_time_s, band, roots, work)
    if found < 0 or not work[DAMPING] > 0.0 or not squared(roots[found]) < 1.0:
        return
    weight = weight_of(roots[found], residue(theta[na:], structure[NK], roots, found), work[DAMPING], sample_time_s)
    mode[REFERENCE_HZ] = work[FREQUENCY_HZ]
    mode[POLE_RE], mode[POLE_IM] = roots[found].real, roots[found].imag
    mode[WEIGHT_RE], mode[WEIGHT_IM] = weight.real, weight.imag


@compiled
def reference_output(structure: IntArray, theta: FloatArray, past: FloatArray) -> float:
    """Return the reference's free-run output of the next sample [output unit]."""
    na = structure[NA]
    value = 0.0
    for i in range(na):
        value -= theta[i] * past[OUTPUT, i]
    for j in range(structure[NB]):
        value += theta[na + j] * past[INPUT, structure[NK] + j]
    return value


@compiled
def take_error(error: float, y: float, mode: FloatArray, through: FloatArray, score: FloatArray) -> None:
    """Add the score of one sample's error to the block's sums; NaN where the sample was not good."""
    psi = sensitivity(complex(mode[WEIGHT_RE], mode[WEIGHT_IM]), through)
    step, y_step = error - mode[ERROR], y - mode[OUTPUT_THEN]
    mode[ERROR], mode[OUTPUT_THEN] = error, y
    if step == step:
        score[GOOD] += 1.0
        score[PSI_E] += psi * step
        score[PSI_2] += psi * psi
        score[ERROR_2] += step * step
        score[OUTPUT_2] += y_step * y_step


@compiled
def watch_block(
    u: FloatArray,
    y: FloatArray,
    okay: BoolArray,
    y_hat: FloatArray,
    structure: IntArray,
    theta: FloatArray,
    mode: FloatArray,
    through: FloatArray,
    past: FloatArray,
    score: FloatArray,
) -> None:
    """Run the reference through the samples of a block; without one, its outputs are those of the estimate."""
    for t in range(u.shape[0]):
        shift_in(past[INPUT], u[t] if np.isfinite(u[t]) else past[INPUT, 0])
        value = y_hat[t]
        if mode[REFERENCE_HZ] > 0.0:
            value = reference_output(structure, theta, past)
            take_error(y[t] - value if okay[t] else np.nan, y[t], mode, through, score)
        pass_torque(past[INPUT, 0], complex(mode[POLE_RE], mode[POLE_IM]), through)
        shift_in(past[OUTPUT], value)


@dataclass(slots=True)
class _Memory:
    """What the watch remembers of the blocks before, all numbers."""

    state: float = TrackingState.STARTING  # of the tracking
    unsettled: float = 0.0  # 1 from an alarm until the value after is reported
    waited: float = 0.0  # excited blocks since the estimate was left to settle
    number: float = 0.0  # blocks since the reference was taken
    learnt: float = 0.0  # ... that the level was learnt from
    error_2: float = 0.0  # ... the squared steps of error and output in them
    output_2: float = 0.0  # squared steps of the output
    side: float = 0.0  # of the last block, if it was beyond the threshold: -1, 0, 1
    level_hz: float = 0.0  # the level [Hz]
    information: float = 0.0  # sum of the information of the blocks in it
    spread_of_x: float = 0.0  # 0 before it is known
    usual: float = 0.0  # mean information of the blocks that the spread is known from
    before_s: float = 0.0  # begin of the last block that was within the threshold, as was the one before
    before_hz: float = 0.0  # the last alarm: the level before
    before_std_hz: float = 0.0  # its standard deviation [Hz]
    found_s: float = 0.0  # when it was raised [s]
    statistic: float = 0.0  # its statistic, in standard deviations
    threshold: float = 0.0  # what that went beyond


class ChangeWatch:
    """The watch with its state; memory does not grow."""

    def __init__(
        self, orders: Orders, sample_time_s: float, band_hz: tuple[float, float], settings: WatchSettings
    ) -> None:
        self.settings = settings
        self.statistic = np.nan
        self._period_s = sample_time_s
        self._block = settings.block_samples(sample_time_s)
        self._block_s = self._block * sample_time_s
        for blocks in (settings.reference_blocks, settings.baseline_blocks):
            settings.threshold(blocks, sample_time_s)  # refused now, and worked out
        self._structure = np.array([orders.na, orders.nb, orders.nk])
        self._band = np.array([*band_hz, LIGHTLY_DAMPED])
        self._memory = _Memory()
        self._live = {
            "theta": np.zeros(orders.n_parameters),
            "mode": np.zeros(N_MODE),
            "through": np.zeros(N_THROUGH),
            "past": np.zeros((2, max(orders.na, orders.nk + orders.nb))),
            "score": np.zeros(N_SCORE),
            "rows": np.zeros((max(settings.reference_blocks, settings.baseline_blocks), 3)),
            "candidates": np.zeros((CANDIDATES, 1 + orders.n_parameters)),
        }
        self._work, self._roots = np.zeros(3), np.zeros(orders.na, dtype=np.complex128)
        self._take_reference(np.zeros(orders.n_parameters))  # compiled now; it has no mode, and is none

    @property
    def doing(self) -> TrackingState:
        """What the watch is doing."""
        return TrackingState(int(self._memory.state))

    def run(self, u: FloatArray, y: FloatArray, okay: BoolArray, estimates: Trajectory) -> None:
        """Take samples of the present block, each array of shape (n,); they may not reach beyond its end."""
        live = self._live
        watch_block(
            u,
            y,
            okay,
            np.ascontiguousarray(estimates.y_hat),
            self._structure,
            live["theta"],
            live["mode"],
            live["through"],
            live["past"],
            live["score"],
        )

    def end_block(
        self, time_s: float, theta: FloatArray, frequency: Level | None, damping: float, excited: bool
    ) -> Alarm | None:
        """Judge the block that ends at ``time_s``; return the alarm that it raises, if it does."""
        score = self._live["score"].tolist()
        self._live["score"][:] = 0.0
        self.statistic = np.nan
        memory = self._memory
        memory.number += 1.0
        if memory.state in (TrackingState.STARTING, TrackingState.SETTLING):
            return self._settle(theta, frequency, damping) if excited and frequency is not None else None
        filled = memory.number > 1.0  # the first block is for the filters to fill
        if not (filled and excited and score[GOOD] >= self.settings.fewest_share * self._block and score[PSI_2] > 0.0):
            memory.side = 0.0
            return None
        deviation_hz, information = score[PSI_E] / score[PSI_2], score[PSI_2]
        if memory.state == TrackingState.WATCHING:
            return self._judge(time_s, deviation_hz, information)
        memory.error_2 += score[ERROR_2]
        memory.output_2 += score[OUTPUT_2]
        self._learn(time_s, deviation_hz, information)
        return None

    def _settle(self, theta: FloatArray, frequency: Level, damping: float) -> Alarm | None:
        """Wait until the estimate has settled, and take one of its last for reference: that of the median damping."""
        memory, last = self._memory, self._live["candidates"]
        last[int(memory.waited) % CANDIDATES] = damping, *theta
        memory.waited += 1.0
        needed_s = self.settings.settling_s if memory.unsettled else 0.0
        if memory.waited < CANDIDATES or memory.waited * self._block_s < needed_s:
            return None
        self._take_reference(last[np.argsort(last[:, 0])[CANDIDATES // 2], 1:])
        if self._live["mode"][REFERENCE_HZ] == 0.0:
            return None
        unsettled, memory.unsettled = memory.unsettled, 0.0
        memory.state, memory.side = TrackingState.LEARNING, 0.0
        memory.number = memory.learnt = memory.error_2 = memory.output_2 = 0.0
        return self._alarm(frequency, settled=True) if unsettled else None

    def _take_reference(self, theta: FloatArray) -> None:
        live = self._live
        live["theta"][:] = theta
        take_reference(
            live["theta"],
            self._structure,
            self._period_s,
            self._band,
            self._work,
            self._roots,
            live["mode"],
            live["through"],
        )

    def _learn(self, time_s: float, deviation_hz: float, information: float) -> None:
        """Take a block into what is usual; watch from the last one on."""
        memory, rows = self._memory, self._live["rows"]
        rows[int(memory.learnt)] = memory.number, deviation_hz, information
        memory.learnt += 1.0
        first = memory.spread_of_x == 0.0
        if memory.learnt < (self.settings.reference_blocks if first else self.settings.baseline_blocks):
            return
        if memory.error_2 >= memory.output_2:  # it explains nothing: an estimate taken at a bad moment
            memory.state = TrackingState.STARTING if first else TrackingState.SETTLING
            return
        number, deviations, weights = rows[: int(memory.learnt)].T
        if first:
            spread = spread_of(number, deviations, weights)
            if not spread.of_x > 0.0:  # signals without any noise: there is no statistic of them
                memory.learnt = 0.0
                return
            memory.spread_of_x, memory.usual = spread.of_x, spread.usual
        level = Baseline.of(deviations, weights)
        memory.level_hz, memory.information = level.level_hz, level.information
        memory.state = TrackingState.WATCHING
        memory.before_s = time_s - self._block_s

    def _judge(self, time_s: float, deviation_hz: float, information: float) -> Alarm | None:
        """Compare a block with what is usual."""
        memory = self._memory
        tolerated_hz = self.settings.smallest_change * float(self._live["mode"][REFERENCE_HZ])
        level = Baseline(memory.level_hz, memory.information)
        self.statistic = level.statistic(deviation_hz, information, tolerated_hz, self._spread)
        threshold = self.settings.threshold(int(memory.learnt), self._period_s)
        side = float(np.sign(self.statistic)) if abs(self.statistic) > threshold else 0.0
        again = side != 0.0 and side == memory.side
        if side == memory.side == 0.0:
            memory.before_s = time_s - self._block_s
        memory.side = side
        if not again:
            return None
        memory.found_s, memory.statistic, memory.threshold = time_s, self.statistic, threshold
        memory.state, memory.unsettled, memory.waited = TrackingState.SETTLING, 1.0, 0.0
        before_std_hz = memory.spread_of_x / np.sqrt(memory.information)
        before = self._by_score(memory.level_hz, float(before_std_hz))
        memory.before_hz, memory.before_std_hz = before.value, before.std
        alarm = self._alarm(self._by_score(deviation_hz, self._spread.variance(information) ** 0.5), settled=False)
        self._take_reference(np.zeros_like(self._live["theta"]))
        return alarm

    def _by_score(self, deviation_hz: float, std_hz: float) -> Level:
        return Level.of(float(self._live["mode"][REFERENCE_HZ]) + deviation_hz, std_hz)

    @property
    def _spread(self) -> Spread:
        return Spread(self._memory.spread_of_x, self._memory.usual)

    def _alarm(self, after: Level, settled: bool) -> Alarm:
        """Write the record of the last change."""
        memory = self._memory
        return Alarm(
            time_s=memory.found_s,
            changed_between_s=(memory.before_s, memory.found_s - self._block_s),
            quantity="resonance_hz",
            before=Level.of(memory.before_hz, memory.before_std_hz),
            after=after,
            settled=settled,
            statistic=memory.statistic,
            threshold=memory.threshold,
            false_alarms_per_hour=self.settings.false_alarms_per_hour,
        )

    def state(self) -> dict[str, FloatArray]:
        """Return what it remembers, by name: arrays that `restore` takes."""
        kept = {name: values.copy() for name, values in self._live.items()}
        return kept | {"memory": np.array(astuple(self._memory), dtype=np.float64)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of a watch with the same settings."""
        for name, values in self._live.items():
            values[:] = state[name]
        self._memory = _Memory(*np.asarray(state["memory"], dtype=np.float64).tolist())
