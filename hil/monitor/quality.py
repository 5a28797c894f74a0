"""Quality of the samples that come: how many are good, what is against the others, how long there was no good one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hil.monitor.ring import Ring
from hil.sample import REMARKS, Sample, SampleFlag

WINDOW_S = 10.0
"""What the counts reach back [s]: short enough that what is over goes away, a thousand cycles at 10 ms."""

STANDS_STILL_S = 0.3
"""Without a good sample for so long [s] the estimate is said to stand still; a lost frame or two are no news."""

NO_VALUE = 1 << 16
"""Besides the bits of `SampleFlag`: no flag, and yet no number, as a recording of another program may have it."""

_WORDS = {
    SampleFlag.LATE: "cycle late",
    SampleFlag.PLC_STALE: "PLC silent",
    SampleFlag.M1_LIMITED: "m1 in its internal limit",
    SampleFlag.M2_LIMITED: "m2 in its internal limit",
    SampleFlag.CHANNEL_LOST: "a channel not read",
    SampleFlag.M1_DOUBTFUL: "a reading of m1 in doubt",
    SampleFlag.M2_DOUBTFUL: "a reading of m2 in doubt",
    NO_VALUE: "no value",
}


@dataclass(frozen=True, slots=True)
class Quality:
    """The samples of the last seconds.

    Attributes
    ----------
    samples, good
        How many, since the first good one of this stretch (listening, or one run); before it there is no counting:
        a drive that has never answered is judged by its own life signs.
    against
        What is against those that are not good, what is remarked on others, and how often; the most frequent first.
    standing_s
        Time since the last good sample [s]; 0 while the latest is good.
    why
        What is against the latest one, in words; empty while it is good.
    """

    samples: int = 0
    good: int = 0
    against: tuple[tuple[str, int], ...] = ()
    standing_s: float = 0.0
    why: str = ""

    @property
    def reasons(self) -> str:
        """What is against samples and how often, in a line; empty where all are good."""
        return ", ".join(f"{what} {count}x" for what, count in self.against)

    @property
    def bad_share(self) -> float:
        """Share of samples that are not good; 0 where there are none."""
        return 1.0 - self.good / self.samples if self.samples else 0.0

    @property
    def stands_still(self) -> bool:
        """Whether good samples have been missing for long enough to be reported."""
        return self.standing_s >= STANDS_STILL_S


def against(sample: Sample) -> int:
    """Tell what is against a sample: its flags but remarks, or that a number is missing; 0 for a good one."""
    numbers = (sample.torque_m1_nm, sample.torque_m2_nm, sample.speed_rad_s)
    return int(sample.flags & ~REMARKS) or (0 if all(map(math.isfinite, numbers)) else NO_VALUE)


def words(bits: int) -> str:
    """Put what is against a sample into words; silent is who did not answer in time."""
    silent = [name for name, flag in (("m1", SampleFlag.M1_STALE), ("m2", SampleFlag.M2_STALE)) if bits & flag]
    found = [f"{', '.join(silent)} silent"] if silent else []
    return "; ".join([*found, *(text for bit, text in _WORDS.items() if bits & bit)])


class QualityWatch:
    """Counts over the last `WINDOW_S`.

    Parameters
    ----------
    period_s
        Time between two samples [s].
    """

    def __init__(self, period_s: float) -> None:
        self._ring = Ring(max(1, math.ceil(WINDOW_S / period_s)), 2)
        self._begun = False
        self._last_good_ns: int | None = None
        self._latest = 0

    def begin(self) -> None:
        """Begin a new stretch: what was before is none of it."""
        self._ring.clear()
        self._begun, self._latest, self._last_good_ns = False, 0, None

    def take(self, sample: Sample) -> int:
        """Take the next sample; give what is against it, as `against`."""
        self._latest = against(sample)
        if self._latest == 0:
            self._begun, self._last_good_ns = True, sample.t_ns
        elif self._last_good_ns is None:
            self._last_good_ns = sample.t_ns
        if self._begun:
            self._ring.append((sample.t_ns / 1e9, self._latest | int(sample.flags)))
        return self._latest

    def look(self, now_ns: int) -> Quality:
        """Tell the quality at a moment of the samples' clock [ns]."""
        rows = self._ring.rows()
        bits = rows[rows[:, 0] > now_ns / 1e9 - WINDOW_S, 1].astype(np.int64)
        counts = [(words(flag), int(np.count_nonzero(bits & flag))) for flag in (*SampleFlag, NO_VALUE) if flag]
        standing_ns = now_ns - self._last_good_ns if self._latest and self._last_good_ns is not None else 0
        return Quality(
            samples=bits.size,
            good=int(np.count_nonzero(bits & ~int(REMARKS) == 0)),
            against=tuple(sorted(((what, n) for what, n in counts if n), key=lambda entry: -entry[1])),
            standing_s=standing_ns / 1e9,
            why=words(self._latest),
        )
