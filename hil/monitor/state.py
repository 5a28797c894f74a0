"""From reports to what is drawn: the whole knowledge of the view, without a screen and without a clock of its own."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from estimator.physics.joint import Shaft, TwistFilter
from hil.monitor.live_estimation import LiveEstimation
from hil.monitor.messages import (
    Began,
    Ended,
    Health,
    LogTopic,
    Lost,
    Notice,
    Over,
    Ready,
    Report,
    Samples,
    as_known,
    outcome,
)
from hil.monitor.plot import Ring
from hil.monitor.snapshot import Activity, Channel, Headline, QualityWatch, Signals, Snapshot
from hil.rig.experiments.base import Phase
from hil.rig.live import USUAL, OnlineSetup
from hil.rig.pacing import NS_PER_S
from hil.sample import Sample

WINDOWS_S = (1.0, 2.0, 5.0, 10.0, 20.0, 60.0)
"""What the plots of the signals may reach back [s]: from single levels of the PRBS to a whole tip-in."""

FIRST_WINDOW = 2

KEPT_NOTICES = 200

RETUNE_SHARE = 0.02
"""Change of the resonance by which the twist filter takes new numbers: computing its gain is not for every sample."""

OWN_SIGNALS = 6
"""Columns of the ring before those of the channels: time, torque, its reference, PRBS, speed, twist."""

NO_MODEL = "no model: give --model"


class LiveState:
    """Takes reports, gives snapshots."""

    def __init__(
        self,
        rig: str,
        period_s: float,
        shaft: Shaft | None,
        can_drive: bool,
        is_ready: Callable[[], bool] = lambda: True,
        setup: OnlineSetup = USUAL,
        channel_units: Mapping[str, str] | None = None,
    ) -> None:
        self.channel_units = dict(channel_units or {})
        self._ring = Ring(math.ceil(WINDOWS_S[-1] / period_s), OWN_SIGNALS + len(self.channel_units))
        self._window = FIRST_WINDOW
        self._model_shaft = shaft
        self._twist = None if shaft is None else TwistFilter(shaft, period_s)
        self._tuned_hz = math.nan
        self._estimation = LiveEstimation(period_s, is_ready, setup)
        self._quality = QualityWatch(period_s)
        self._health: Health | None = None
        self._log: deque[Notice] = deque(maxlen=KEPT_NOTICES)
        self._now_ns = 0  # of the latest sample; 0 before the first
        self._silent_ns = 0  # since then, as of the last picture
        self._latest: Sample | None = None
        self._can_drive = can_drive
        self._headline = Headline(rig, Activity.CONNECTING, "", "", math.nan, math.nan, "", "")
        self.runs: list[Over] = []
        self.ended: Ended | None = None

    @property
    def activity(self) -> Activity:
        """What is happening."""
        return self._headline.activity

    @property
    def is_driving(self) -> bool:
        """Whether a run is starting, under way or ordered to stop."""
        return self.activity in (Activity.STARTING, Activity.RUNNING, Activity.STOPPING)

    def zoom(self, by: int) -> None:
        """Let the plots of the signals reach back further, or less far."""
        self._window = min(max(self._window + by, 0), len(WINDOWS_S) - 1)

    def say(self, text: str) -> None:
        """Put a message for the operator on the screen."""
        self._headline = replace(self._headline, message=text)

    def stopping(self, text: str) -> None:
        """Note that the run has been ordered to stop."""
        if self.is_driving:
            self._headline = replace(self._headline, activity=Activity.STOPPING, message=text)

    def starting(self, experiment: str) -> None:
        """Note that a run has been ordered."""
        self._headline = replace(
            self._headline, activity=Activity.STARTING, experiment=experiment, phase="arming", message=""
        )

    def take(self, report: Report) -> None:
        """Take a report of the source."""
        match report:
            case Samples():
                self._take_samples(report)
            case Health():
                self._health = report
            case Notice():
                self._note(report)
            case Began():
                self._begin(report)
            case Over():
                self._end(report)
            case Ready() | Lost() | Ended():
                self._turn(report)

    def snapshot(self, silent_s: float = 0.0) -> Snapshot:
        """Give the picture of now; nothing has come for ``silent_s`` [s]."""
        self._silent_ns = round(silent_s * NS_PER_S)
        return Snapshot(
            headline=replace(self._headline, silent_s=silent_s),
            signals=self._signals(),
            estimation=self._estimation.look(self._now_ns),
            health=self._health,
            log=tuple(self._log),
            now_ns=self._now_ns + self._silent_ns,
            runs=len(self.runs),
            can_drive=self._can_drive,
            quality=self._quality.look(self._now_ns),
        )

    def _take_samples(self, report: Samples) -> None:
        self._silent_ns = 0
        if not self._now_ns:  # what was said before had no clock yet
            first_ns = report.rows[0][0].t_ns
            self._log = deque((replace(each, t_ns=first_ns) for each in self._log), maxlen=KEPT_NOTICES)
        if report.lost:
            self._tell(LogTopic.INFO, f"{report.lost} samples not shown: this terminal did not take them in time")
        measured = [sample for sample, phase in report.rows if phase is Phase.MEASURE]
        for sample, _ in report.rows:
            self._keep(sample)
        for alarm in self._estimation.take(measured):
            self._note(Notice(self._now_ns, LogTopic.ALARM, alarm.statement))
        self._retune()
        sample, phase = report.rows[-1]
        self._latest = sample
        if phase is not None and self.is_driving:
            self._headline = replace(self._headline, phase=phase.value, phase_s=sample.time_s)
        elif self.activity is Activity.REPLAYING:
            self._headline = replace(self._headline, phase_s=sample.time_s)

    def _keep(self, sample: Sample) -> None:
        torque_nm, speed_rad_s = sample.torque_m1_nm + sample.torque_m2_nm, sample.speed_rad_s
        okay = self._quality.take(sample) == 0
        twist_rad = math.nan if self._twist is None else self._twist.step(torque_nm, speed_rad_s, okay)
        if not okay:
            torque_nm, speed_rad_s = math.nan, math.nan
        self._now_ns = sample.t_ns
        self._ring.append(
            (
                sample.t_ns / NS_PER_S,
                torque_nm,
                sample.torque_ref_nm,
                sample.prbs_nm,
                speed_rad_s,
                twist_rad,
                *sample.channels,
            )
        )

    def _retune(self) -> None:
        """Let the twist follow the resonance: k and c from it, the inertias from the model."""
        mode = self._estimation.resonance
        if mode is None or self._twist is None or self._model_shaft is None or mode.damping <= 0.0:
            return
        if not abs(mode.frequency_hz / self._tuned_hz - 1.0) < RETUNE_SHARE:
            self._tuned_hz = mode.frequency_hz
            self._twist.use(self._model_shaft.with_resonance(mode))

    def _signals(self) -> Signals:
        window_s, latest, rows = WINDOWS_S[self._window], self._latest, self._ring.rows()
        rows = rows[np.searchsorted(rows[:, 0], self._now_ns / NS_PER_S - window_s) :]
        return Signals(
            time_s=rows[:, 0] - self._now_ns / NS_PER_S,
            torque_nm=rows[:, 1],
            reference_nm=rows[:, 2],
            prbs_nm=rows[:, 3],
            speed_rad_s=rows[:, 4],
            twist_rad=rows[:, 5],
            torque_m1_nm=math.nan if latest is None else latest.torque_m1_nm,
            torque_m2_nm=math.nan if latest is None else latest.torque_m2_nm,
            window_s=window_s,
            twist_of=NO_MODEL if self._twist is None else f"k, c: {self._twist.shaft.source}",
            twist_std_rad=math.nan if self._twist is None else self._twist.twist_std_rad,
            channels=tuple(
                Channel(name, unit, rows[:, OWN_SIGNALS + number])
                for number, (name, unit) in enumerate(self.channel_units.items())
            ),
        )

    def _begin(self, report: Began) -> None:
        self._estimation.begin()
        self._quality.begin()
        self._headline = replace(
            self._headline,
            activity=Activity.RUNNING if self._can_drive else Activity.REPLAYING,
            experiment=report.experiment,
            phase="",
            phase_s=0.0,
            duration_s=report.duration_s,
            recording=report.recording,
            message="",
        )
        if self._can_drive:
            self._tell(LogTopic.RUN, f"{report.experiment} begins, recorded as {as_known(report.recording)}")

    def _end(self, report: Over) -> None:
        self._estimation.end()
        self._quality.begin()
        self.runs.append(report)
        activity = Activity.LISTENING if self._can_drive else Activity.PLAYED
        self._headline = replace(
            self._headline, activity=activity, experiment="", phase="", phase_s=math.nan, recording=""
        )
        text = (
            outcome(report) if self._can_drive else f"{report.samples} samples played, {report.flagged} of them flagged"
        )
        self._tell(LogTopic.FAULT if report.reason else LogTopic.RUN, text)
        self.say(text)

    def _turn(self, report: Ready | Lost | Ended) -> None:
        """Take note that the rig is there, that its bus is lost, or that nothing follows."""
        match report:
            case Ready():
                if self.activity is Activity.LOST:
                    self._tell(LogTopic.INFO, "the bus is there again")
                self._quality.begin()
                waited = self.activity in (Activity.CONNECTING, Activity.LOST)  # and what was said then is over
                message = "" if waited else self._headline.message
                self._headline = replace(self._headline, activity=Activity.LISTENING, message=message)
            case Lost():
                if self.activity is not Activity.LOST:
                    self._tell(LogTopic.FAULT, report.reason)
                self._headline = replace(self._headline, activity=Activity.LOST, message=report.reason)
            case Ended():
                self.ended = report
                self._headline = replace(self._headline, activity=Activity.ENDED, message=report.error or "")

    def _note(self, notice: Notice) -> None:
        self._log.append(notice)
        if notice.kind is not LogTopic.INFO:
            self.say(f"{notice.kind.value}: {notice.text}")

    def _tell(self, kind: LogTopic, text: str) -> None:
        self._log.append(Notice(self._now_ns + self._silent_ns, kind, text))
