"""The 10 ms cycle: guard, both inverters' commands, SYNC, both answers, supervision, one `Sample`.

Time is the pacer's (`hil.rig.pacing.Tick`), so that a run that waits for nothing behaves as one on the wall
clock: ages count from when a cycle really began, the guard's rate limit from when it was due, since a
torque may change by so much per cycle. Only `CanLink.sync` stamps host time, where the frame leaves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.inverter.drive_supervision import DriveRecord
from drivers.inverter.inverter import Inverter, InverterFeedback
from drivers.inverter.supervision import NO_PART, CycleRecord, PlcPart, Supervision, SupervisionLimits
from drivers.torque_guard import Evidence, GuardedTorque, TorqueRequest
from hil.errors import RunAborted
from hil.rig.build import Devices
from hil.rig.pacing import NS_PER_S, Tick
from hil.rig.timing import RunTiming
from hil.sample import Sample, SampleFlag

_DOUBTS = {
    (False, False): SampleFlag.GOOD,
    (True, False): SampleFlag.M1_DOUBTFUL,
    (False, True): SampleFlag.M2_DOUBTFUL,
    (True, True): SampleFlag.M1_DOUBTFUL | SampleFlag.M2_DOUBTFUL,
}


@dataclass(slots=True)
class _Station:
    """One inverter in the cycle, and its last answer."""

    inverter: Inverter
    stale: SampleFlag
    limited: SampleFlag
    torque_nm: float = math.nan
    speed_rad_s: float = math.nan

    def take(self, feedback: InverterFeedback | None) -> SampleFlag:
        """Keep an answer, or flag that there is none; flag a torque that a limit of the drive holds back."""
        if feedback is None:
            return self.stale
        self.torque_nm = feedback.torque_nm
        self.speed_rad_s = feedback.speed_rad_s
        return self.limited if feedback.limited else SampleFlag.GOOD

    def record(self, command: GuardedTorque, feedback: InverterFeedback | None) -> DriveRecord:
        """Build what the supervision judges."""
        offset_nm = command.prbs_nm if self.inverter.has_offset else 0.0
        return DriveRecord(command.base_nm + command.prbs_nm, feedback, *self.inverter.messages(), offset_nm)


class Cycle:
    """Everything that happens between two SYNC."""

    __slots__ = ("_answer_timeout_ns", "_channels", "_guard", "_link", "_m1", "_m2", "_supervision", "timing")

    def __init__(
        self, devices: Devices, period_ns: int, answer_timeout_s: float, timing: RunTiming | None = None
    ) -> None:
        m1, m2 = devices.m1, devices.m2
        self._link, self._guard, self._channels = devices.link, devices.guard, devices.channels
        self._m1 = _Station(m1, SampleFlag.M1_STALE, SampleFlag.M1_LIMITED)
        self._m2 = _Station(m2, SampleFlag.M2_STALE, SampleFlag.M2_LIMITED)
        self.timing = timing or RunTiming(period_ns)
        self._answer_timeout_ns = round(answer_timeout_s * NS_PER_S)
        limits = SupervisionLimits(self._guard.limits, m1.count_rad_s, m2.count_rad_s, devices.vehicle)
        self._supervision = Supervision(limits, m1.settings, m2.settings)

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
        return self._supervision.ready

    def step(
        self,
        tick: Tick,
        request: TorqueRequest,
        time_s: float,
        flags: SampleFlag,
        permissive_age_ns: int = 0,
        plc: PlcPart = NO_PART,
    ) -> Sample:
        """Run one cycle, in which the PLC may add what ``plc`` has."""
        self.raise_if_ended()
        age_ns = self._age_if_fit(tick)
        evidence = Evidence(age_ns, permissive_age_ns, self.fastest_rad_s)
        command_m1, command_m2 = self._guard.check(request, tick.due_ns, evidence)
        if self.timing.is_late(tick):
            flags |= SampleFlag.LATE
        self._m1.inverter.command(command_m1)
        self._m2.inverter.command(command_m2)
        sync_ns = self._link.sync()
        self.timing.begin(tick, sync_ns)
        waited_ns, m1, m2 = self._await_answers(sync_ns)
        record = CycleRecord(tick.now_ns, self._m1.record(command_m1, m1), self._m2.record(command_m2, m2), plc)
        flags |= self._m1.take(m1) | self._m2.take(m2) | _DOUBTS[self._supervision.take(record)]
        channels = self._channels.read(sync_ns, (self._answer_timeout_ns - waited_ns) / NS_PER_S)  # what is left of it
        if any(map(math.isnan, channels)):
            flags |= SampleFlag.CHANNEL_LOST
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
            age_ns=max(self._supervision.ages_ns(tick.now_ns)),
            flags=flags,
            channels=channels,
        )

    def raise_if_ended(self) -> None:
        """End the run where its last cycle has, once the sample is kept; the guard is then disabled."""
        if self._supervision.ended is None:
            return
        self._guard.disable()
        self._m1.inverter.raise_if_faulted()
        self._m2.inverter.raise_if_faulted()
        self._supervision.raise_if_ended()

    def _await_answers(self, sync_ns: int) -> tuple[int, InverterFeedback | None, InverterFeedback | None]:
        """Wait for both: they answer the same SYNC, and the time they have is one and the same."""
        age_m1_ns, m1 = self._await_answer(self._m1, sync_ns, 0)
        age_m2_ns, m2 = self._await_answer(self._m2, sync_ns, age_m1_ns)
        return max(age_m1_ns, age_m2_ns), m1, m2

    def _await_answer(self, station: _Station, sync_ns: int, waited_ns: int) -> tuple[int, InverterFeedback | None]:
        """Wait for one; give how long after the SYNC the waiting ended [ns], and the answer if it came in time."""
        patience_ns = self._answer_timeout_ns - waited_ns
        feedback = station.inverter.await_feedback(sync_ns, patience_ns / NS_PER_S)
        age_ns = None if feedback is None else feedback.t_ns - sync_ns
        if age_ns is None or age_ns > self._answer_timeout_ns:
            feedback, age_ns = None, None
        self.timing.answer(age_ns)
        return self._answer_timeout_ns if age_ns is None else age_ns, feedback

    def _age_if_fit(self, tick: Tick) -> int:
        """Have both drives well and their feedback fresh; give its age [ns]."""
        self._m1.inverter.raise_if_faulted()
        self._m2.inverter.raise_if_faulted()
        ages_ns = self._supervision.ages_ns(tick.now_ns)
        age_ns = max(ages_ns)
        timeout_s = self._guard.limits.feedback_timeout_s
        if age_ns > timeout_s * NS_PER_S:
            if tick.late_ns > self.timing.period_ns:
                raise RunAborted(
                    f"cycle {tick.cycle} began {tick.late_ns / NS_PER_S:.3f} s late, so that its feedback is "
                    f"{age_ns / NS_PER_S:.3f} s old, expected at most {timeout_s:g} s (feedback_timeout_s). This "
                    "machine was too busy: close other programs."
                )
            self._supervision.raise_if_old(ages_ns)
        return age_ns

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
        """See that this machine was not late by as much as feedback may be old: then nothing else is to blame."""
        timeout_s = self._guard.limits.feedback_timeout_s
        if tick.late_ns > max(self.timing.period_ns, timeout_s * NS_PER_S):
            raise RunAborted(
                f"cycle {tick.cycle} began {tick.late_ns / NS_PER_S:.3f} s late, expected at most {timeout_s:g} s "
                "(feedback_timeout_s). This machine was too busy, or the program was suspended: close other programs."
            )
