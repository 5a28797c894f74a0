"""The estimate of a run while it lasts: what `hil run` works out next to the cycle, and `hil replay` once more.

The cycle comes first: a sample gets here when its frames are out, its answers in and its row recorded
(`hil.rig.drive.Observer`).

A torque that was not read, or is flagged, is held at its last good value, as reading the recording does
(`hil.recording.signals`), so that the run and its replay are the same to the bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from estimator.identification.chain import OnlineChain, OnlineEstimate
from estimator.identification.online.adaptation import ConstantForgetting
from estimator.identification.settings import Settings
from estimator.signals.record import FloatArray
from hil.rig.experiments.base import Phase
from hil.rig.live_course import Course
from hil.rig.pacing import NS_PER_S, period_ns
from hil.sample import Sample

FORGETTING = 0.995
"""lambda_1: a sample 200 kept ones old, 4 s at 20 ms, weighs a third. A stiffness that drops is followed in seconds."""


def tracking_settings(sample_time_s: float = Settings().sample_time_s) -> Settings:
    """Return how a resonance is followed: the paper's settings, but with a constant forgetting.

    The paper's profile keeps learning until tr F has fallen to 0.01, for minutes, and is then slow to change.
    """
    return Settings(sample_time_s=sample_time_s, adaptation=ConstantForgetting(FORGETTING))


class OnlineSetup(NamedTuple):
    """What estimates on line: settings, and the observation filter of an earlier run (`tracking_chain`)."""

    settings: Settings = tracking_settings()
    L: FloatArray | None = None


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
    """Estimates from the samples of the measured part; an `Observer`.

    Parameters
    ----------
    chain
        The on-line chain, for the samples' period.
    """

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
