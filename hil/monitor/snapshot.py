"""What the view draws: one frozen picture of everything at one moment. Nothing here knows of a screen."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from estimator.identification.linear_model import ComplexArray
from estimator.identification.tracking.alarm import Alarm, TrackingState
from estimator.signals.record import FloatArray
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

SILENT_AFTER_S = 2.0
"""Without a word from the source for so long [s] the screen says how old it is."""


@dataclass(frozen=True, slots=True)
class Quality:
    """The samples of the last seconds."""

    samples: int = 0  # of the last `WINDOW_S`, from the first good one of this stretch (listening, or one run)
    good: int = 0  # of these; a remark is no fault
    against: tuple[tuple[str, int], ...] = ()  # what is against samples, and how many; the most frequent first
    standing_s: float = 0.0  # time since the last good sample [s]; 0 while the latest is good
    why: str = ""  # what is against the latest one, in words

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
    """Counts over the last `WINDOW_S`."""

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
    """What is happening."""

    rig: str  # its name, or that of the recording that is played
    activity: Activity  # what is happening
    experiment: str  # of the run under way
    phase: str  # of the run under way: value of `Phase`, or "arming"; empty where none is known
    phase_s: float  # time since the phase began [s]; NaN while there is none
    duration_s: float  # of the measured part [s]
    recording: str  # path for the run under way, name of one that is played; empty without either
    message: str  # the last thing the operator has to know
    silent_s: float = 0.0  # time since the source last said anything [s]: so old is what is shown


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """A further measured channel: its column in recordings, its unit, and its values, shape (N,)."""

    name: str  # column in recordings
    unit: str  # as in the rig file
    values: FloatArray  # NaN where it was not read


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """The last seconds."""

    time_s: FloatArray  # shape (N,), 0 for the latest sample and negative before it [s]
    torque_nm: FloatArray  # shape (N,), of both inverters as read; NaN where a sample does not count
    reference_nm: FloatArray  # shape (N,), of both inverters, PRBS included
    prbs_nm: FloatArray  # shape (N,), of both inverters
    speed_rad_s: FloatArray  # shape (N,); NaN where a sample does not count
    twist_rad: FloatArray  # shape (N,), of the shaft; NaN without a model
    torque_m1_nm: float  # of the latest sample, as read [Nm]; NaN before the first
    torque_m2_nm: float  # the same of inverter m2
    window_s: float  # what the plots reach back [s]
    twist_of: str  # where the numbers behind the twist are from, or why there is none
    twist_std_rad: float  # standard deviation of the twist; NaN without a model
    channels: tuple[Channel, ...] = ()  # the further ones of the rig file, in its order


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """The resonance over time, shape (n,) each; ``time_s`` is 0 now and negative before [s]."""

    time_s: FloatArray  # oldest first
    frequency_hz: FloatArray  # of the resonance
    frequency_std_hz: FloatArray  # standard deviation
    damping: FloatArray  # damping ratio
    damping_std: FloatArray  # standard deviation


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """The on-line model."""

    frequency_hz: FloatArray  # shape (n,)
    gain: FloatArray  # shape (n,), magnitude of the response from torque to speed
    poles: ComplexArray  # in z, shape (na,)
    zeros: ComplexArray  # in z
    trail: ComplexArray  # poles of models before, oldest first, shape (m,)
    sample_time_s: float  # its period [s]
    # shape (m,), where the response without a model is known
    measured_hz: FloatArray = field(default_factory=lambda: np.empty(0))
    measured_gain: FloatArray = field(default_factory=lambda: np.empty(0))  # shape (m,), its magnitude there


@dataclass(frozen=True, slots=True, eq=False)
class Estimation:
    """What the on-line chain says; None and NaN where it says nothing yet."""

    status: str  # the estimator's own word, and why
    live: bool  # whether samples come in
    resonance_hz: float  # frequency; NaN while there is no resonance to be used
    resonance_std_hz: float  # standard deviation
    damping: float  # damping ratio
    damping_std: float  # standard deviation
    history: History  # of the resonance, over runs
    model: Model | None  # None before there is one, and while it would be one of noise
    alarms: tuple[Alarm, ...]  # oldest first
    state: TrackingState | None = None  # what the tracking is doing


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """Everything at one moment; ``health`` is None until the rig has sent it, and stays so for a recording."""

    headline: Headline  # first line of the screen, and its message
    signals: Signals  # in the window that was chosen
    estimation: Estimation  # of the run under way, or of the last
    health: Health | None
    log: tuple[Notice, ...]  # oldest first
    now_ns: int  # the present, on the samples' clock; 0 before the first sample
    runs: int  # that are over
    can_drive: bool  # False where a recording is played
    quality: Quality  # of the samples of the last seconds
