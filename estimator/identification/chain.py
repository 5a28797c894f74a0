"""The on-line chain: samples of the bus in, the driveline's model and its resonance out, while driving.

One code for a sample and for a block: what a rig computed while driving comes out of its recording again, to the
bit. Nothing in the loop raises on a value; the estimate's status says what is wrong with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimator.errors import BadSetting, BadShape
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import Mode
from estimator.identification.online.estimators import Filtering, Oefo
from estimator.identification.online.recursive import Estimate, RecursiveEstimator, Status, Trajectory
from estimator.identification.settings import SAMPLES_PER_PARAMETER, Settings
from estimator.identification.tracking.alarm import Alarm, TrackingState
from estimator.identification.tracking.follow import Follower
from estimator.identification.tracking.tracker import Tracker
from estimator.identification.tracking.watch import ChangeWatch, WatchSettings
from estimator.signals.decimate import Decimated, Decimator
from estimator.signals.record import BoolArray, FloatArray, IntArray, Record

NOT_EXCITED = "at the resonance the torque moves the output less than the noise does; switch the PRBS on or raise it"
"""What is wrong where the torque says nothing of the resonance, and what to do."""

VERSION = 3  # of a saved state; goes up when a part changes its meaning


@dataclass(frozen=True, slots=True, eq=False)
class OnlineEstimate:
    """State of the on-line chain after one kept sample."""

    time_s: float  # of the sample, in the recording's time [s]
    estimate: Estimate  # of the recursive estimator, with its status
    model: LinearModel  # its parameters as a model
    resonance: Mode | None  # dominant lightly damped mode
    frequency_std_hz: float  # standard deviations of its natural frequency [Hz] and damping ratio
    damping_std: float  # standard deviation of the damping ratio
    state: TrackingState  # what the tracking is doing
    alarm: Alarm | None = None  # A change that was found at this sample

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
    """The same of every kept sample of a block."""

    time_s: FloatArray  # (n,): moments [s]
    estimates: Trajectory  # of the recursive estimator, length n
    frequency_hz: FloatArray  # (n,): the resonance
    damping: FloatArray  # (n,): the resonance
    height: FloatArray  # (n,): the resonance
    frequency_std_hz: FloatArray  # (n,): standard deviations
    damping_std: FloatArray  # (n,): standard deviations
    state: IntArray  # (n,): values of :class:`TrackingState`
    alarms: tuple[Alarm, ...]  # changes found in the block, in order of time
    alarm_at: tuple[int, ...]  # at which kept sample of the block each was found
    orders: Orders  # structure and sampling period of the models [s]
    sample_time_s: float  # period of the kept samples [s]

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


EstimatorFactory = Callable[[Settings, FloatArray | None], RecursiveEstimator]
"""Makes a recursive estimator from the settings and L (None: there is no batch model yet)."""


def oefo(settings: Settings, L: FloatArray | None) -> Oefo:
    """Make the paper's estimator; without L the filter follows the present A_hat (AFOLOE)."""
    if L is not None:
        return settings.estimator(L)
    start_up = SAMPLES_PER_PARAMETER * settings.orders.n_parameters
    return Oefo(np.ones(1), settings.orders, settings.adaptation, Filtering.ADAPTED, start_up)


class OnlineChain:
    """The chain with its state; memory does not grow.

    Parameters
    ----------
    settings : Settings
        As for a recording; ``samples`` does not end it.
    sample_time_s : float
        Sampling period of what will come [s]; ``settings.sample_time_s`` is a whole multiple of it.
    L : ndarray, optional
        Observation filter's denominator, from a batch model of an earlier run. None: there is none yet, and
        the filter follows the estimate.
    estimator : callable, optional
        Makes another recursive estimator than OEFO.
    watch : WatchSettings, optional
        How a change of the resonance is watched for.

    Raises
    ------
    BadSetting
        If the models' period is no whole multiple of the samples'.
    """

    def __init__(
        self,
        settings: Settings,
        sample_time_s: float,
        L: FloatArray | None = None,
        estimator: EstimatorFactory = oefo,
        watch: WatchSettings | None = None,
    ) -> None:
        self.settings = settings
        self.L = None if L is None else L.copy()
        factor = decimation_factor(settings, sample_time_s)
        self._decimator = Decimator(sample_time_s, factor, settings.high_pass_hz)
        made, watch = estimator(settings, L), watch or WatchSettings()
        self.orders, period_s, band_hz = made.orders, settings.sample_time_s, settings.band_hz
        self._watch_settings = watch
        self._tracker = Tracker(
            made,
            Follower(self.orders, period_s, band_hz, watch.block_samples(period_s)),
            ChangeWatch(self.orders, period_s, band_hz, watch),
        )
        self._seen = 0
        self._factor = factor
        self._one = (np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1, dtype=np.bool_))
        # An empty block compiles every loop now, so that the first cycle on the rig does not wait for it.
        self.run_block(np.empty(0), np.empty(0), np.empty(0), np.empty(0, dtype=np.bool_))

    @property
    def delay_s(self) -> float:
        """How long after its moment an estimate comes: the delay of the low-pass [s]."""
        return self._decimator.delay_samples * self._decimator.sample_time_s

    def push(self, time_s: float, torque_nm: float, output: float, okay: bool = True) -> OnlineEstimate | None:
        """Take one sample.

        Parameters
        ----------
        time_s : float
            Its moment [s].
        torque_nm : float
            Total torque [Nm].
        output : float
            Speed, or whatever the output is [rad/s].
        okay : bool
            False masks it.

        Returns
        -------
        OnlineEstimate or None
            None where the decimation keeps nothing of this sample.
        """
        times, torques, outputs, mask = self._one
        times[0], torques[0], outputs[0], mask[0] = time_s, torque_nm, output, okay
        kept_times, kept = self._kept_times(times), self._decimator.run(torques, outputs, mask)
        return self._estimated(kept_times, kept)[0] if kept.u.size else None

    def run(self, record: Record) -> OnlineTrajectory:
        """Take a whole recording, with the same bits as sample by sample."""
        return self.run_block(record.time_s, self.torque_of(record), record.output, record.okay)

    @staticmethod
    def torque_of(record: Record) -> FloatArray:
        """Return a recording's total torque as a rig would have passed it on, shape (N,) [Nm].

        It is missing where none had been read yet: a recording has the first that was read there, and a rig can not
        look ahead.
        """
        unread = np.logical_and.accumulate(~record.torque_trusted.all(axis=1))
        return np.where(unread, np.nan, record.total_torque_nm)

    def run_block(
        self, time_s: FloatArray, torque_nm: FloatArray, output: FloatArray, okay: BoolArray
    ) -> OnlineTrajectory:
        """Take a block of samples, each array of shape (N,); see :meth:`push`.

        Raises
        ------
        BadShape
            If the arrays do not have one shape (N,).
        """
        if time_s.shape != torque_nm.shape:
            raise BadShape(
                f"on-line chain: time_s and torque_nm have the shapes {time_s.shape} and {torque_nm.shape}, expected "
                "one shape (N,). Give every signal one value per sample."
            )
        kept = self._decimator.run(torque_nm, output, okay)
        return self._estimated(self._kept_times(time_s), kept)

    def state(self) -> dict[str, Any]:
        """Return everything the chain remembers: text, numbers and arrays, each name with its part in front.

        ``numpy.savez(path, **state)`` keeps it as it is; lists of the same numbers are restored as well.
        """
        kept: dict[str, Any] = {"version": VERSION, "settings": repr((self.settings, self._watch_settings))}
        kept |= {f"decimator.{name}": value for name, value in self._decimator.state().items()}
        return kept | self._tracker.state() | {"seen": self._seen}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state: what follows has the bits it would have had without the break.

        Raises
        ------
        BadSetting
            If the state is not that of a chain of this version with these settings, or lacks a part.
        """
        own = self.state()
        for name in ("version", "settings"):
            if str(np.asarray(state.get(name))) != str(own[name]):
                raise BadSetting(
                    f"on-line chain: the state's {name} is {state.get(name)}, expected {own[name]}. Restore it into a "
                    "chain with the settings of the one that was saved."
                )
        if missing := sorted(own.keys() - state.keys()):
            raise BadSetting(f"on-line chain: the state has no {', '.join(missing)}, expected every part of one saved.")
        decimator = (name for name in own if name.startswith("decimator."))
        self._decimator.restore({name.removeprefix("decimator."): state[name] for name in decimator})
        self._tracker.restore(state)
        self._seen = int(np.asarray(state["seen"]))

    def _kept_times(self, time_s: FloatArray) -> FloatArray:
        """Pick the moments of the samples kept of the next block, the low-pass's delay taken out."""
        kept = time_s[-self._seen % self._factor :: self._factor] - self.delay_s
        self._seen = (self._seen + time_s.shape[0]) % self._factor
        return kept

    def _estimated(self, times: FloatArray, kept: Decimated) -> OnlineTrajectory:
        tracked = self._tracker.run(times, kept.u, kept.y, kept.okay)
        found = tracked.found
        return OnlineTrajectory(
            time_s=times,
            estimates=tracked.estimates,
            frequency_hz=found.frequency_hz,
            damping=found.damping,
            height=found.height,
            frequency_std_hz=found.frequency_std_hz,
            damping_std=found.damping_std,
            state=tracked.state,
            alarms=tracked.alarms,
            alarm_at=tracked.alarm_at,
            orders=self.orders,
            sample_time_s=self._decimator.sample_time_s,
        )


def decimation_factor(settings: Settings, sample_time_s: float) -> int:
    """Return how many samples of a period [s] make one of the models'."""
    ratio = settings.sample_time_s / sample_time_s if sample_time_s > 0 else 0.0
    factor = round(ratio)
    if factor < 1 or abs(ratio - factor) > 1e-3 * ratio:
        raise BadSetting(
            f"on-line chain: samples come every {sample_time_s:g} s, expected a whole fraction of the models' period "
            f"{settings.sample_time_s:g} s. Choose another period for the models."
        )
    return factor
