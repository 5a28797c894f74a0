"""The estimators on the samples as they come, and what is compiled for them beforehand."""

from __future__ import annotations

import math
import multiprocessing
import os
import threading
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from estimator.errors import EstimatorError, NotExciting
from estimator.identification.chain import OnlineEstimate
from estimator.identification.linear_model import ComplexArray
from estimator.identification.modes.modes import Mode
from estimator.identification.online.recursive import Status
from estimator.identification.tracking.alarm import Alarm
from estimator.signals.decimate import high_passed
from estimator.signals.record import FloatArray, Record
from hil.child import safe_path
from hil.monitor.plot import Ring
from hil.monitor.snapshot import Estimation, History, Model
from hil.rig.live import USUAL, LiveEstimate, OnlineSetup, tracking_chain
from hil.rig.pacing import NS_PER_S
from hil.sample import Sample

SPECTRUM_S = 30.0
"""What the response without a model is estimated from [s]."""

SPECTRUM_EVERY_S = 2.0

KNOWN = 0.5
"""Coherence from which on a frequency is shown."""

HISTORY_EVERY_NS = 250_000_000
"""Time between two points of the history [ns]."""

HISTORY_POINTS = 2400
"""Ten minutes of measuring."""

TRAIL_EVERY = 2
"""A set of poles is kept of every so many points of the history."""

TRAIL_MODELS = 60

RESPONSE_POINTS = 160

KEPT_ALARMS = 20

VALUES_PER_WIDTH = 2

SAMPLES = 64

NICE = 10
"""The cycle and the screen come first."""


class LiveEstimation:
    """Estimates a run while it lasts, and keeps what was before."""

    def __init__(
        self, period_s: float, is_ready: Callable[[], bool] = lambda: True, setup: OnlineSetup = USUAL
    ) -> None:
        self._setup = setup
        self._is_ready = is_ready
        self._waiting: list[Sample] = []
        self._period_s = period_s
        self._live_estimate: LiveEstimate | None = None
        self._history = Ring(HISTORY_POINTS, 5)
        self._trail: deque[ComplexArray] = deque(maxlen=TRAIL_MODELS)
        self._alarms: deque[Alarm] = deque(maxlen=KEPT_ALARMS)
        self._samples = Ring(round(SPECTRUM_S / period_s), 3)
        self._since_spectrum = 0
        self._last_cycle: int | None = None
        self._measured = (np.empty(0), np.empty(0))
        self._refused: str | None = None
        self._kept_ns = 0
        self._points = 0
        self._live = False

    @property
    def _latest(self) -> OnlineEstimate | None:
        return None if self._live_estimate is None else self._live_estimate.latest

    @property
    def resonance(self) -> Mode | None:
        """The present resonance; None while there is none to be used."""
        return None if self._latest is None else self._latest.resonance

    def begin(self) -> None:
        """Begin anew with the next sample: a run is about to be measured. The history continues."""
        self._live_estimate, self._refused = None, None
        self._waiting = []
        self._samples.clear()
        self._last_cycle = None
        self._measured = (np.empty(0), np.empty(0))
        self._trail.clear()
        self._live = True
        try:
            self._live_estimate = LiveEstimate(tracking_chain(self._period_s, *self._setup))
        except EstimatorError as error:
            self._refused = str(error)

    def end(self) -> None:
        """Note that the run is over; its last estimate stays."""
        self._live = False

    def take(self, samples: Sequence[Sample]) -> tuple[Alarm, ...]:
        """Take measured samples in order; give the alarms they set off."""
        live = self._live_estimate
        if live is None:
            return ()
        self._waiting += samples
        if not self._waiting or not self._is_ready():
            return ()
        samples, self._waiting = self._waiting, []
        n_alarms = len(live.course.alarms)
        for sample in samples:
            live(sample)
            self._keep(sample)
            if live.latest is not None:
                self._remember(live.latest, sample.t_ns)
        self._since_spectrum += len(samples)
        if self._since_spectrum * self._period_s >= SPECTRUM_EVERY_S:
            self._since_spectrum, self._measured = 0, self._spectrum()
        alarms = tuple(live.course.alarms[n_alarms:])
        for alarm in alarms:
            if self._alarms and not self._alarms[-1].settled:  # it comes once more, settled
                self._alarms.pop()
            self._alarms.append(alarm)
        return alarms

    def _remember(self, latest: OnlineEstimate, t_ns: int) -> None:
        mode = latest.resonance
        if mode is None or abs(t_ns - self._kept_ns) < HISTORY_EVERY_NS:
            return
        self._kept_ns = t_ns
        self._history.append(
            (t_ns / NS_PER_S, mode.frequency_hz, latest.frequency_std_hz, mode.damping, latest.damping_std)
        )
        if self._points % TRAIL_EVERY == 0:
            self._trail.append(latest.model.poles)
        self._points += 1

    def look(self, now_ns: int) -> Estimation:
        """Tell what is known; ``now_ns`` is the samples' present time [ns]."""
        latest = self._latest
        mode = None if latest is None else latest.resonance
        return Estimation(
            status=self._status(),
            live=self._live,
            resonance_hz=math.nan if mode is None else mode.frequency_hz,
            resonance_std_hz=math.nan if latest is None else latest.frequency_std_hz,
            damping=math.nan if mode is None else mode.damping,
            damping_std=math.nan if latest is None else latest.damping_std,
            history=self._shown_history(now_ns),
            model=self._shown_model(),
            alarms=tuple(self._alarms),
            state=None if latest is None else latest.state,
        )

    def _keep(self, sample: Sample) -> None:
        """Keep a sample for the spectrum, and the cycles that were left out before it as missing."""
        missing = 0 if self._last_cycle is None else sample.cycle - self._last_cycle - 1
        for _ in range(min(missing, round(SPECTRUM_S / self._period_s))):
            self._samples.append((0.0, 0.0, 0.0))
        self._last_cycle = sample.cycle
        torque_nm, speed = sample.torque_m1_nm + sample.torque_m2_nm, sample.speed_rad_s
        okay = sample.counts and math.isfinite(torque_nm + speed)
        self._samples.append((torque_nm, speed, 1.0) if okay else (0.0, 0.0, 0.0))

    def _spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Return where the response without a model is known, and its magnitude there."""
        from estimator.identification.spectral import spectral_estimate  # scipy's statistics: not before the bus

        torque_nm, speed, okay = self._samples.rows().T
        good = okay > 0.0
        time_s = self._period_s * np.arange(good.size)
        record = Record("live", self._period_s, time_s, torque_nm[:, np.newaxis], speed, good, torque_okay=good)
        try:
            found = spectral_estimate(high_passed(record), VALUES_PER_WIDTH)
        except NotExciting:
            return np.empty(0), np.empty(0)
        known = found.coherence > KNOWN
        return found.frequency_hz[known], np.abs(found.response[known])

    def _status(self) -> str:
        if self._refused is not None:
            return f"no estimate: {self._refused}"
        if self._latest is None:
            if self._waiting:
                return "the estimator is being compiled: once, and again after an update"
            return "waits for samples" if self._live else "no run yet"
        latest = self._latest
        if latest.status is Status.ESTIMATED and latest.resonance is None:
            return "estimated, no resonance in the band"
        word = latest.state.words if latest.status is Status.NOT_EXCITED else latest.status.value
        return word + (f": {latest.reason}" if latest.reason else "")

    def _shown_history(self, now_ns: int) -> History:
        rows = self._history.rows()
        return History(rows[:, 0] - now_ns / NS_PER_S, *(rows[:, column] for column in range(1, 5)))

    def _shown_model(self) -> Model | None:
        if self._latest is None or self._latest.estimate.status is Status.UNESTIMATED:
            return None
        if self._latest.status is Status.NOT_EXCITED and self._latest.resonance is None:  # a model of noise
            return None
        model = self._latest.model
        low, high = 0.5, 0.5 / model.sample_time_s
        frequency_hz = np.geomspace(low, high, RESPONSE_POINTS)
        return Model(
            frequency_hz=frequency_hz,
            gain=np.abs(model.response(frequency_hz)),
            poles=model.poles,
            zeros=model.zeros,
            trail=np.concatenate(self._trail) if self._trail else np.empty(0, dtype=np.complex128),
            sample_time_s=model.sample_time_s,
            measured_hz=self._measured[0],
            measured_gain=self._measured[1],
        )


class WarmUp:
    """Makes the on-line chain ready, from a thread that begins at once and ends with the program.

    What compiles is a process, which is started here and not in the thread: once the view runs, standard error is its
    own, without a file that a process could be given.
    """

    def __init__(self, period_s: float, setup: OnlineSetup = USUAL) -> None:
        self._of = (period_s, setup)
        self._failed: Exception | None = None
        self._process = multiprocessing.get_context("spawn").Process(target=_compile, args=self._of, daemon=True)
        with safe_path():
            self._process.start()
        self._thread = threading.Thread(target=self._run, name="compiling", daemon=True)
        self._thread.start()

    def is_done(self) -> bool:
        """Whether the chain is compiled; raises what that has failed by."""
        if self._failed is not None:
            raise self._failed
        return not self._thread.is_alive()

    def _run(self) -> None:
        self._process.join()
        try:
            run_once(*self._of)
        except Exception as error:  # noqa: BLE001 - raised where someone asks: a thread's own is lost
            self._failed = error


def run_once(period_s: float, setup: OnlineSetup = USUAL) -> None:
    """Run the chain on nothing; a period that has no chain has none to compile, and the view says so in a run."""
    try:
        chain = tracking_chain(period_s, *setup)
    except EstimatorError:
        return
    for number in range(SAMPLES):
        chain.push(number * period_s, 0.0, 0.0)


def _compile(period_s: float, setup: OnlineSetup) -> None:
    if hasattr(os, "nice"):
        os.nice(NICE)
    run_once(period_s, setup)
