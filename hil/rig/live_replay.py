"""A recording played through the on-line chain: the estimates of the run that made it, to the bit.

In blocks, since one call from Python per sample would be a hundred times slower; the chain sees no difference.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from estimator.identification.settings import Settings
from estimator.signals.record import FloatArray, Record
from hil.rig.live import LiveEstimate, tracking_chain
from hil.rig.live_course import Course
from hil.sample import Sample

BLOCK_SAMPLES = 10_000
"""Samples of a block when nothing has to be waited for."""

BLOCK_S = 0.1
"""Length of a block on the wall clock at a given speed [s]."""

OnCourse = Callable[[Course, float], None]
"""Called after each block with the course so far and the time in the recording [s]."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast to play.

    Attributes
    ----------
    speed
        Multiple of real time; None: as fast as it goes.
    clock, sleep
        The wall clock [s], and how to wait.
    """

    speed: float | None = None
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep

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
