"""What the view draws: one frozen picture of everything at one moment. Nothing here knows of a screen."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from estimator.identification.tracking.alarm import Alarm, TrackingState
from hil.monitor.messages import Health, Notice
from hil.monitor.quality import Quality

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
    """

    frequency_hz: FloatArray
    gain: FloatArray
    poles: ComplexArray
    zeros: ComplexArray
    trail: ComplexArray
    sample_time_s: float


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
