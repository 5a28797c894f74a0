"""What the view draws: one frozen picture of everything at one moment. Nothing here knows of a screen."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from estimator.identification.tracking.alarm import Alarm, TrackingState
from hil.monitor.messages import Health, Notice
from hil.monitor.plot import Ring
from hil.sample import REMARKS, Sample, SampleFlag

WINDOW_S = 10.0
"""What the counts reach back [s]: short enough that what is over goes away, a thousand cycles at 10 ms."""

STANDS_STILL_S = 0.3
"""Without a good sample for so long [s] the estimate is said to stand still; a lost frame or two are no news."""

NO_VALUE = 2 * max(SampleFlag)
"""Besides the bits of `SampleFlag`: no flag, and yet no number, as a recording of another program may have it."""

_WORDS = {
    SampleFlag.LATE: "cycle late",
    SampleFlag.PLC_STALE: "PLC silent",
    SampleFlag.M1_LIMITED: "m1 in its internal limit",
    SampleFlag.M2_LIMITED: "m2 in its internal limit",
    SampleFlag.CHANNEL_LOST: "a channel not read",
    SampleFlag.M1_DOUBTFUL: "m1 doubtful",
    SampleFlag.M2_DOUBTFUL: "m2 doubtful",
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


FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


SILENT_AFTER_S = 2.0
"""Without a word from the source for so long [s] the screen says how old it is."""


class Activity(Enum):
    """What is happening; the value is the word on the screen."""

    CONNECTING = "CONNECTING"
    LISTENING = "LISTENING, drives disarmed"
    STARTING = "STARTING"
    RUNNING = "RUNNING"
    REPLAYING = "REPLAYING"
    PLAYED = "END OF THE RECORDING"
    STOPPING = "STOPPING"
    LOST = "BUS LOST"
    ENDED = "ENDED"


@dataclass(frozen=True, slots=True)
class Headline:
    """What is happening.

    Attributes
    ----------
    rig
        Its name, or that of the recording that is played.
    activity
        What is happening.
    experiment, phase, phase_s, duration_s, recording
        Of the run under way; empty, NaN while there is none. ``duration_s`` is that of the measured part.
    message
        The last thing the operator has to know; it stays until another comes.
    silent_s
        Time since the source last said anything [s]: so old is what is shown.
    """

    rig: str
    activity: Activity
    experiment: str
    phase: str
    phase_s: float
    duration_s: float
    recording: str
    message: str
    silent_s: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """A further measured channel: its column in recordings, its unit, and its values, shape (N,)."""

    name: str
    unit: str
    values: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """The last seconds.

    Attributes
    ----------
    time_s
        Shape (N,), 0 for the latest sample and negative before it [s].
    torque_nm, reference_nm, prbs_nm, speed_rad_s, twist_rad
        Shape (N,); NaN where there is no value.
    torque_m1_nm, torque_m2_nm
        The latest of each inverter [Nm].
    window_s
        What the plots reach back [s].
    twist_of
        Where the numbers behind the twist are from, or why there is none.
    twist_std_rad
        Its standard deviation by the filter's own reckoning [rad]; NaN while there is none.
    channels
        The further ones of the rig file, in its order.
    """

    time_s: FloatArray
    torque_nm: FloatArray
    reference_nm: FloatArray
    prbs_nm: FloatArray
    speed_rad_s: FloatArray
    twist_rad: FloatArray
    torque_m1_nm: float
    torque_m2_nm: float
    window_s: float
    twist_of: str
    twist_std_rad: float
    channels: tuple[Channel, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """The resonance over time, shape (n,) each; ``time_s`` is 0 now and negative before [s]."""

    time_s: FloatArray
    frequency_hz: FloatArray
    frequency_std_hz: FloatArray
    damping: FloatArray
    damping_std: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """The on-line model.

    Attributes
    ----------
    frequency_hz, gain
        Shape (n,): its frequency response, magnitude [rad/s per Nm].
    poles, zeros
        In z.
    trail
        Poles of models before, oldest first, shape (m,).
    sample_time_s
        Its period [s].
    measured_hz, measured_gain
        Shape (m,): the response of the last samples without a model, where it is known; empty before there are enough.
    """

    frequency_hz: FloatArray
    gain: FloatArray
    poles: ComplexArray
    zeros: ComplexArray
    trail: ComplexArray
    sample_time_s: float
    measured_hz: FloatArray = field(default_factory=lambda: np.empty(0))
    measured_gain: FloatArray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, slots=True, eq=False)
class Estimation:
    """What the on-line chain says; None and NaN where it says nothing yet.

    Attributes
    ----------
    status
        The estimator's own word, and why.
    live
        Whether samples come in: else the figures are of the last run.
    state
        What the tracking is doing; None before the first estimate.
    """

    status: str
    live: bool
    resonance_hz: float
    resonance_std_hz: float
    damping: float
    damping_std: float
    history: History
    model: Model | None
    alarms: tuple[Alarm, ...]
    state: TrackingState | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """Everything at one moment; ``health`` is None until the rig has sent it, and stays so for a recording."""

    headline: Headline
    signals: Signals
    estimation: Estimation
    health: Health | None
    log: tuple[Notice, ...]
    now_ns: int
    runs: int
    can_drive: bool
    quality: Quality
