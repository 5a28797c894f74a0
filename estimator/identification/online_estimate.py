"""What the on-line chain says of one kept sample, and of a block of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import Mode
from estimator.identification.online.recursive import Estimate, Status, Trajectory
from estimator.identification.tracking.alarm import Alarm
from estimator.identification.tracking.state import TrackingState
from estimator.signals.record import FloatArray, IntArray

NOT_EXCITED = "at the resonance the torque moves the output less than the noise does; switch the PRBS on or raise it"
"""What is wrong where the torque says nothing of the resonance, and what to do."""


@dataclass(frozen=True, slots=True, eq=False)
class OnlineEstimate:
    """State of the on-line chain after one kept sample.

    Attributes
    ----------
    time_s : float
        Moment of the recording the sample stands for, the low-pass's delay taken out [s].
    estimate : Estimate
        Of the recursive estimator, with its status.
    model : LinearModel
        Its parameters as a model.
    resonance : Mode or None
        Dominant lightly damped mode; None where there is none, or the estimate is not to be used.
    frequency_std_hz, damping_std : float
        Standard deviations of its natural frequency [Hz] and damping ratio; NaN where not known.
    state : TrackingState
        What the tracking is doing.
    alarm : Alarm or None
        A change that was found at this sample.
    """

    time_s: float
    estimate: Estimate
    model: LinearModel
    resonance: Mode | None
    frequency_std_hz: float
    damping_std: float
    state: TrackingState
    alarm: Alarm | None = None

    @property
    def status(self) -> Status:
        """Whether the estimate may be used: the estimator's own word, unless the torque says nothing of it."""
        return Status.NOT_EXCITED if self.state is TrackingState.NOT_EXCITED else self.estimate.status

    @property
    def reason(self) -> str:
        """What is wrong and what to do; empty where nothing is."""
        return NOT_EXCITED if self.state is TrackingState.NOT_EXCITED else self.estimate.reason.message


@dataclass(frozen=True, slots=True, eq=False)
class OnlineTrajectory:
    """The same of every kept sample of a block.

    Attributes
    ----------
    time_s : ndarray, shape (n,)
        Moments [s].
    estimates : Trajectory
        Of the recursive estimator, length n.
    frequency_hz, damping, height : ndarray, shape (n,)
        The resonance; NaN where there is none.
    frequency_std_hz, damping_std : ndarray, shape (n,)
        Standard deviations; NaN where not known.
    state : ndarray of int, shape (n,)
        Values of :class:`TrackingState`.
    alarms : tuple of Alarm
        Changes found in the block, in order of time.
    alarm_at : tuple of int
        At which kept sample of the block each was found.
    orders, sample_time_s
        Structure and sampling period of the models [s].
    """

    time_s: FloatArray
    estimates: Trajectory
    frequency_hz: FloatArray
    damping: FloatArray
    height: FloatArray
    frequency_std_hz: FloatArray
    damping_std: FloatArray
    state: IntArray
    alarms: tuple[Alarm, ...]
    alarm_at: tuple[int, ...]
    orders: Orders
    sample_time_s: float

    def __len__(self) -> int:
        return int(self.time_s.shape[0])

    def __getitem__(self, k: int) -> OnlineEstimate:
        """Return what :meth:`OnlineChain.push` returned for kept sample ``k`` of the block."""
        k = range(len(self))[k]
        frequency_hz = float(self.frequency_hz[k])
        has_mode = frequency_hz == frequency_hz
        mode = Mode(frequency_hz, float(self.damping[k]), float(self.height[k])) if has_mode else None
        return OnlineEstimate(
            time_s=float(self.time_s[k]),
            estimate=self.estimates[k],
            model=LinearModel.from_theta(self.estimates.theta[k], self.orders, self.sample_time_s),
            resonance=mode,
            frequency_std_hz=float(self.frequency_std_hz[k]),
            damping_std=float(self.damping_std[k]),
            state=TrackingState(int(self.state[k])),
            alarm=dict(zip(self.alarm_at, self.alarms, strict=True)).get(k),
        )

    def __iter__(self) -> Iterator[OnlineEstimate]:
        return (self[k] for k in range(len(self)))
