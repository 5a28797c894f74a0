"""The 10 ms cycle: guard, both inverters' commands, SYNC, both answers, one `Sample`.

Time is the pacer's (`hil.rig.pacing.Tick`), so that a run that waits for nothing behaves as one on the wall
clock: ages count from when a cycle really began, the guard's rate limit from when it was due, since a
torque may change by so much per cycle. Only `CanLink.sync` stamps host time, where the frame leaves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from drivers.canopen.can_link import CanLink
from drivers.errors import DeviceTimeout
from drivers.inverter.inverter import Inverter, InverterFeedback
from drivers.message_rate import MessageRate
from drivers.torque_guard import Evidence, Measured, TorqueGuard, TorqueRequest
from hil.errors import RunAborted
from hil.rig.channels import Channels
from hil.rig.pacing import NS_PER_S, Tick
from hil.rig.timing import RunTiming
from hil.sample import Sample, SampleFlag


@dataclass(slots=True)
class _Station:
    """One inverter in the cycle: its last answer and the time of the cycle that got it."""

    name: str
    inverter: Inverter
    stale: SampleFlag
    limited: SampleFlag
    torque_nm: float = math.nan
    speed_rad_s: float = math.nan
    answered_ns: int | None = None
    measured: Measured | None = None
    raw: tuple[int, int] | None = None
    rate: MessageRate = field(init=False)

    def __post_init__(self) -> None:
        self.rate = MessageRate(self.inverter.settings.where)

    def take(self, feedback: InverterFeedback | None, now_ns: int) -> SampleFlag:
        """Keep an answer, or flag that there is none; flag a torque that a limit of the drive holds back."""
        self.measured = None
        if feedback is None:
            return self.stale
        raw = (feedback.torque_raw, feedback.speed_raw)
        self.measured = Measured(feedback.torque_nm, self.inverter.admits_less, raw == self.raw)
        self.raw = raw
        self.torque_nm = feedback.torque_nm
        self.speed_rad_s = feedback.speed_rad_s
        self.answered_ns = now_ns
        return self.limited if feedback.limited else SampleFlag.GOOD


class Cycle:
    """Everything that happens between two SYNC.

    Parameters
    ----------
    link
        The bus both inverters are on.
    m1, m2
        The inverters, configured. The resolver is read through m1.
    guard
        What every request has to pass.
    period_ns
        Time between two cycles [ns].
    answer_timeout_s
        How long the inverters may take to answer a SYNC [s].
    timing
        Takes note of when cycles begin and answers come; a new one by default.
    channels
        What else is read; nothing by default.
    """

    __slots__ = ("_answer_timeout_ns", "_channels", "_first_ns", "_guard", "_link", "_m1", "_m2", "timing")

    def __init__(
        self,
        link: CanLink,
        m1: Inverter,
        m2: Inverter,
        guard: TorqueGuard,
        period_ns: int,
        answer_timeout_s: float,
        timing: RunTiming | None = None,
        channels: Channels | None = None,
    ) -> None:
        self._link = link
        self._m1 = _Station("m1", m1, SampleFlag.M1_STALE, SampleFlag.M1_LIMITED)
        self._m2 = _Station("m2", m2, SampleFlag.M2_STALE, SampleFlag.M2_LIMITED)
        self._guard = guard
        self.timing = timing or RunTiming(period_ns)
        self._answer_timeout_ns = round(answer_timeout_s * NS_PER_S)
        self._first_ns: int | None = None
        self._channels = channels

    @property
    def speed_rad_s(self) -> float:
        """Latest resolver speed [rad/s]; NaN before the first answer."""
        return self._m1.speed_rad_s

    @property
    def largest_step_nm(self) -> float:
        """Largest change of one inverter's base torque from one cycle to the next [Nm]."""
        limits = self._guard.limits
        return limits.rate_limit_nm_per_s * limits.period_s

    @property
    def answered(self) -> bool:
        """Whether both inverters have answered at least once, and follow their target torques."""
        return all(each.answered_ns is not None and each.inverter.follows for each in (self._m1, self._m2))

    def step(
        self, tick: Tick, request: TorqueRequest, time_s: float, flags: SampleFlag, permissive_age_ns: int = 0
    ) -> Sample:
        """Run one cycle.

        Parameters
        ----------
        tick
            The cycle's number and time.
        request
            What the experiment asks for.
        time_s
            Time of the sample in the recording [s].
        flags
            What is already known against the sample.
        permissive_age_ns
            Age of the PLC's permission; 0 where no PLC is asked [ns].

        Raises
        ------
        CommandRefused
            If the guard refuses the request.
        DeviceFault
            If an inverter reports a fault, gives another torque than it is commanded, or answers too often.
        DeviceTimeout
            If an inverter has not answered for as long as the guard's feedback time-out.
        RunAborted
            If this machine itself was late by as much.
        """
        self._refuse_if_unfit(tick)
        evidence = Evidence(self._age_ns(tick.now_ns), permissive_age_ns, self.fastest_rad_s)
        command_m1, command_m2 = self._guard.check(request, tick.due_ns, evidence)
        if self.timing.is_late(tick):
            flags |= SampleFlag.LATE
        self._m1.inverter.command(command_m1)
        self._m2.inverter.command(command_m2)
        sync_ns = self._link.sync()
        self.timing.begin(tick, sync_ns)
        waited_ns, stale = self._await_answers(sync_ns, tick.now_ns)
        self._guard.compare(tick.due_ns, self._m1.measured, self._m2.measured)
        channels = self._read_channels(sync_ns, waited_ns)
        if any(map(math.isnan, channels)):
            flags |= SampleFlag.CHANNEL_LOST
        return self._sample(tick, request, time_s, sync_ns, flags | stale, channels)

    def _await_answers(self, sync_ns: int, now_ns: int) -> tuple[int, SampleFlag]:
        """Wait for both: they answer the same SYNC, and the time they have is one and the same."""
        age_m1_ns, flag_m1 = self._await_answer(self._m1, sync_ns, 0, now_ns)
        age_m2_ns, flag_m2 = self._await_answer(self._m2, sync_ns, age_m1_ns, now_ns)
        return max(age_m1_ns, age_m2_ns), flag_m1 | flag_m2 if flag_m1 or flag_m2 else SampleFlag.GOOD

    def _read_channels(self, sync_ns: int, waited_ns: int) -> tuple[float, ...]:
        """Read the further channels in the time that the inverters have left."""
        if self._channels is None:
            return ()
        return self._channels.read(sync_ns, (self._answer_timeout_ns - waited_ns) / NS_PER_S)

    def _await_answer(self, station: _Station, sync_ns: int, waited_ns: int, now_ns: int) -> tuple[int, SampleFlag]:
        """Wait for one; return how long after the SYNC the waiting ended [ns], and what is against the answer."""
        patience_ns = self._answer_timeout_ns - waited_ns
        feedback = station.inverter.await_feedback(sync_ns, patience_ns / NS_PER_S)
        age_ns = None if feedback is None else feedback.t_ns - sync_ns
        if age_ns is None or age_ns > self._answer_timeout_ns:
            feedback, age_ns = None, None
        self.timing.answer(age_ns)
        return self._answer_timeout_ns if age_ns is None else age_ns, station.take(feedback, now_ns)

    def _refuse_if_unfit(self, tick: Tick) -> None:
        if self._first_ns is None:
            self._first_ns = tick.now_ns
        for station in (self._m1, self._m2):
            station.inverter.raise_if_faulted()
            self._refuse_if_old(station, tick)
            station.rate.take(station.inverter.received)

    @property
    def speeds_rad_s(self) -> tuple[float, float]:
        """The speed of the one shaft, as each inverter reads it; NaN before it answered [rad/s]."""
        return self._m1.speed_rad_s, self._m2.speed_rad_s

    @property
    def fastest_rad_s(self) -> float:
        """The reading furthest from standstill; NaN before both answered [rad/s]."""
        speeds = self.speeds_rad_s
        return math.nan if any(map(math.isnan, speeds)) else max(speeds, key=abs)

    def refuse_if_overslept(self, tick: Tick) -> None:
        """See that this machine was not late by as much as feedback may be old: then nothing else is to blame.

        Raises
        ------
        RunAborted
            If it was.
        """
        timeout_s = self._guard.limits.feedback_timeout_s
        if tick.late_ns > max(self.timing.period_ns, timeout_s * NS_PER_S):
            raise RunAborted(
                f"cycle {tick.cycle} began {tick.late_ns / NS_PER_S:.3f} s late, expected at most {timeout_s:g} s "
                "(feedback_timeout_s). This machine was too busy, or the program was suspended: close other programs."
            )

    def _refuse_if_old(self, station: _Station, tick: Tick) -> None:
        timeout_s = self._guard.limits.feedback_timeout_s
        age_s = (tick.now_ns - self._last_ns(station)) / NS_PER_S
        if age_s <= timeout_s:
            return
        if tick.late_ns > self.timing.period_ns:
            raise RunAborted(
                f"cycle {tick.cycle} began {tick.late_ns / NS_PER_S:.3f} s late, so that its feedback is "
                f"{age_s:.3f} s old, expected at most {timeout_s:g} s (feedback_timeout_s). This machine was "
                "too busy: close other programs."
            )
        raise DeviceTimeout(
            f"inverter {station.name}: no TPDO for {age_s:.3f} s, expected one per SYNC and none missing "
            f"for more than {timeout_s:g} s (feedback_timeout_s). Check its supply and its cabling; a simulated one "
            "answers late on a busy machine."
        )

    def _last_ns(self, station: _Station) -> int:
        """Time of the cycle that got the last answer; of the first cycle while there is none [ns]."""
        if station.answered_ns is not None:
            return station.answered_ns
        return 0 if self._first_ns is None else self._first_ns

    def _age_ns(self, now_ns: int) -> int:
        return now_ns - min(self._last_ns(self._m1), self._last_ns(self._m2))

    def _sample(
        self,
        tick: Tick,
        request: TorqueRequest,
        time_s: float,
        sync_ns: int,
        flags: SampleFlag,
        channels: tuple[float, ...],
    ) -> Sample:
        return Sample(
            cycle=tick.cycle,
            t_ns=sync_ns,
            time_s=time_s,
            torque_ref_m1_nm=request.total_m1_nm,
            torque_ref_m2_nm=request.total_m2_nm,
            prbs_nm=request.prbs_m1_nm + request.prbs_m2_nm,
            torque_m1_nm=self._m1.torque_nm,
            torque_m2_nm=self._m2.torque_nm,
            speed_rad_s=self.speed_rad_s,
            age_ns=self._age_ns(tick.now_ns),
            flags=flags,
            channels=channels,
        )
