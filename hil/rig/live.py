"""The estimate of a run while it lasts: what `hil run` works out next to the cycle, and `hil replay` once more.

The cycle comes first: a sample gets here when its frames are out, its answers in and its row recorded
(`hil.rig.drive.Observer`).

A torque that was not read, or is flagged, is held at its last good value, as reading the recording does
(`hil.recording.signals`), so that the run and its replay are the same to the bit. A replay plays in blocks, since one
call from Python per sample would be a hundred times slower; the chain sees no difference.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimator.identification.chain import OnlineChain, OnlineEstimate
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.settings import Settings
from estimator.signals.record import FloatArray, Record
from hil.rig.experiments.base import Phase
from hil.rig.live_course import Course
from hil.rig.pacing import NS_PER_S, period_ns
from hil.sample import Sample

FORGETTING = 0.995
"""lambda_1: a sample 200 kept ones old, 4 s at 20 ms, weighs a third. A stiffness that drops is followed in seconds."""

BLOCK_SAMPLES = 10_000
"""Samples of a block when nothing has to be waited for."""

BLOCK_S = 0.1
"""Length of a block on the wall clock at a given speed [s]."""


def tracking_settings(sample_time_s: float = Settings().sample_time_s) -> Settings:
    """Return how a resonance is followed: the paper's settings, but with a constant forgetting.

    The paper's profile keeps learning until tr F has fallen to 0.01, for minutes, and is then slow to change.
    """
    return Settings(sample_time_s=sample_time_s, adaptation=ConstantForgetting(FORGETTING))


class OnlineSetup(NamedTuple):
    """What estimates on line: settings, and the observation filter of an earlier run (`tracking_chain`)."""

    settings: Settings = tracking_settings()  # of the recursive estimator and of what comes before it
    L: FloatArray | None = None  # (m,), 1 first, powers of 1/z; None: the filter follows the estimate


USUAL = OnlineSetup()


def tracking_chain(period_s: float, settings: Settings | None = None, L: FloatArray | None = None) -> OnlineChain:
    """Make the chain for samples of a period [s]; counted in whole nanoseconds, as the pacers do.

    With an observation filter L of an earlier run it is the paper's; without, the filter follows the estimate.
    """
    return OnlineChain(settings or tracking_settings(), period_ns(period_s) / NS_PER_S, L)


@dataclass(slots=True)
class _Held:
    """The torque of one inverter: the last that was good."""

    torque_nm: float = math.nan

    def take(self, torque_nm: float, good: bool) -> bool:
        """Take a reading; tell whether it is to be used."""
        good = good and math.isfinite(torque_nm)
        if good:
            self.torque_nm = torque_nm
        return good


class LiveEstimate:
    """Estimates from the samples of the measured part; an `Observer`."""

    def __init__(self, chain: OnlineChain) -> None:
        self.course = Course(chain)
        self.latest: OnlineEstimate | None = None
        self._chain = chain
        self._m1, self._m2 = _Held(), _Held()
        self._begun = False

    def __call__(self, sample: Sample, phase: Phase = Phase.MEASURE) -> None:
        """Take the next sample."""
        if phase is not Phase.MEASURE:
            return
        good = sample.counts
        m1, m2 = self._m1.take(sample.torque_m1_nm, good), self._m2.take(sample.torque_m2_nm, good)
        self._begun |= m1 and m2
        torque_nm = self._m1.torque_nm + self._m2.torque_nm if self._begun else math.nan
        okay = m1 and m2 and math.isfinite(sample.speed_rad_s)
        estimate = self._chain.push(sample.time_s, torque_nm, sample.speed_rad_s, okay)
        self.course.samples += 1
        if estimate is not None:
            self.latest = estimate
            self.course.append(estimate)


OnCourse = Callable[[Course, float], None]
"""Called after each block with the course so far and the time in the recording [s]."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast to play."""

    speed: float | None = None  # multiple of real time; None: as fast as it can
    clock: Callable[[], float] = time.monotonic  # the wall clock [s]
    sleep: Callable[[float], None] = time.sleep  # waits for so long [s]

    def block_samples(self, sample_time_s: float) -> int:
        """Return how many samples to take at once."""
        if self.speed is None:
            return BLOCK_SAMPLES
        return int(np.clip(round(BLOCK_S * self.speed / sample_time_s), 1, BLOCK_SAMPLES))

    def waits(self) -> Callable[[float], None]:
        """Start the clock; return what waits until a time of the recording has come [s since its start]."""
        begun_s = self.clock()

        def wait(since_start_s: float) -> None:
            if self.speed is not None:
                self.sleep(max(begun_s + since_start_s / self.speed - self.clock(), 0.0))

        return wait


def play_record(
    record: Record, settings: Settings, pace: Pace, on_course: OnCourse, L: FloatArray | None = None
) -> Course:
    """Play a recording in blocks; return what the chain said."""
    chain = tracking_chain(record.sample_time_s, settings, L)
    course, size, wait = Course(chain), pace.block_samples(record.sample_time_s), pace.waits()
    torque_nm = chain.torque_of(record)
    for first in range(0, record.time_s.shape[0], size):
        part = slice(first, first + size)
        block = chain.run_block(record.time_s[part], torque_nm[part], record.output[part], record.okay[part])
        course.extend(block)
        course.samples += record.time_s[part].shape[0]
        wait(float(record.time_s[part][-1] - record.time_s[0]))
        on_course(course, float(record.time_s[part][-1]))
    return course


def play_samples(
    samples: Iterable[Sample],
    period_s: float,
    settings: Settings,
    pace: Pace,
    on_course: OnCourse,
    L: FloatArray | None = None,
) -> Course:
    """Play samples as they come, such as those of a bus trace; return what the chain said."""
    live, every, wait = LiveEstimate(tracking_chain(period_s, settings, L)), pace.block_samples(period_s), pace.waits()
    for sample in samples:
        live(sample)
        if live.course.samples % every == 0:
            wait(sample.time_s)
            on_course(live.course, sample.time_s)
    return live.course
