"""The cycles of one run, between arming and disarming: who asks what of whom in each of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from hil.rig.catch_up import CatchUp
from hil.rig.cycle import Cycle
from hil.rig.excitation import NO_TORQUE, PlcPrbs
from hil.rig.experiments.base import Phase
from hil.rig.pacing import NS_PER_S, Pacer, Tick
from hil.rig.plan import Plan
from hil.rig.plc_watch import PlcWatch
from hil.rig.stop import StopRequest
from hil.rig.timing import RunTiming
from hil.sample import Sample, SampleFlag

SLEPT_THROUGH = SampleFlag.LATE | SampleFlag.M1_STALE | SampleFlag.M2_STALE
"""Flags of a cycle this machine was too late for: there was no SYNC, and the torque stood."""


def unread(sample: Sample) -> Sample:
    """Return a sample whose channels were not read."""
    if not sample.channels:
        return sample
    return replace(sample, channels=(math.nan,) * len(sample.channels), flags=sample.flags | SampleFlag.CHANNEL_LOST)


class Recorder(Protocol):
    """Where the samples of the measured part go, one by one."""

    def append(self, sample: Sample) -> None:
        """Take the next sample."""
        ...


CycleProgress = Callable[[Phase, float], None]
"""Called once per cycle with the phase and the time since it began [s]."""

Observer = Callable[[Sample, Phase], None]
"""Given every sample after its cycle's work: frames sent, answers taken, row recorded.

In the measured part it sees what the recording holds, stand-ins for cycles that did not take place included. The
beginning of the next cycle has to wait for what it takes of time; an error it raises ends the run at zero torque.
"""


@dataclass(slots=True)
class RunSummary:
    """What a run came to."""

    timing: RunTiming  # when cycles began and answers came
    cycles: int = 0  # cycles driven, all phases
    recorded: int = 0  # samples recorded
    flagged: int = 0  # recorded samples that are not good
    most_late_ns: int = 0  # latest beginning of a cycle [ns]


@dataclass(slots=True)
class Drive:
    """One experiment, cycle by cycle."""

    plan: Plan  # what to do
    cycle: Cycle  # one exchange with both inverters
    watch: PlcWatch  # the PLC's permission
    prbs: PlcPrbs  # the PLC's own generator, switched with the phases
    pacer: Pacer  # when each cycle begins
    recorder: Recorder  # where samples go
    stop: StopRequest  # ends the run at the next cycle when requested
    progress: CycleProgress  # called with every cycle
    observers: Sequence[Observer] = ()  # given every sample
    _summary: RunSummary = field(init=False)  # what `run` returns, filled in as it advances
    _catch_up: CatchUp = field(init=False)  # spreads the step of the base torque after cycles that are missing
    _phase: Phase = Phase.APPROACH  # of the latest cycle
    _phase_from: int = 0  # number of the cycle in which it began
    _last: Sample | None = None  # latest recorded sample
    _late: Tick | None = None  # latest cycle that began more than a period late
    _cycle: int = 0  # number of the latest cycle

    def __post_init__(self) -> None:
        self._summary = RunSummary(self.cycle.timing)
        self._catch_up = CatchUp(self.cycle.largest_step_nm / self.plan.split.largest_base_share)

    @property
    def lateness(self) -> str:
        """How late this machine was within the last second, in words; empty where it was not."""
        late = self._late
        if late is None or (self._cycle - late.cycle) * self.pacer.period_ns > NS_PER_S:
            return ""
        return f"cycle {late.cycle} began {late.late_ns / NS_PER_S:.3f} s late"

    def wake_up(self) -> None:
        """Cycle at zero torque until both inverters have answered; the cycle itself ends a wait in vain."""
        while not self.cycle.answered:
            self._stand_still()

    def run(self) -> RunSummary:
        """Drive the experiment to its end; the torque guard is enabled."""
        first = self._stand_still().cycle + 1  # the guard counts its rate limit from a cycle at zero torque
        self._phase_from = first
        while self._phase is not Phase.DONE:
            self._drive(first)
        return self._summary

    def _drive(self, first: int) -> None:
        tick, flags = self._begin()
        base = self.plan.experiment.torque(self._seconds(tick.cycle - first), self.cycle.speed_rad_s)
        if base.phase is not self._phase:
            self._phase, self._phase_from = base.phase, tick.cycle
        time_s = self._seconds(tick.cycle - self._phase_from)
        base_nm = self._catch_up.torque_nm(tick.cycle, base.torque_nm)
        prbs_nm = self.plan.prbs_nm(base.phase)
        damping_nm = self.plan.damping_nm(base.phase, tick.cycle)
        request = self.plan.split.request(base_nm, prbs_nm + damping_nm)
        self.prbs.follow(tick, base.phase, self.watch.status)
        part = self.prbs.part(tick)
        sample = self.cycle.step(tick, request, time_s, flags, self.watch.status.age_ns(tick.now_ns), part)
        if self.plan.plc_prbs is not None:
            sample = replace(sample, prbs_nm=self.prbs.known_nm(self.watch.news))
        elif self.plan.damper is not None:
            sample = replace(sample, prbs_nm=prbs_nm)
        if base.phase is Phase.MEASURE:
            self._record(sample)
        else:
            self._show(sample)
        self.cycle.raise_if_ended()
        self.progress(base.phase, time_s)

    def _stand_still(self) -> Tick:
        tick, flags = self._begin()
        self.cycle.step(tick, NO_TORQUE, 0.0, flags)
        self.cycle.raise_if_ended()
        return tick

    def _begin(self) -> tuple[Tick, SampleFlag]:
        self.stop.raise_if_requested()
        tick = self.pacer.next()
        self._cycle = tick.cycle
        if tick.late_ns > self.pacer.period_ns:
            self._late = tick
        self._summary.cycles += 1
        self._summary.most_late_ns = max(self._summary.most_late_ns, tick.late_ns)
        self.cycle.refuse_if_overslept(tick)  # first: whatever looks wrong after a stall is its consequence
        return tick, self.watch.look(tick, *self.cycle.speeds_rad_s)

    def _record(self, sample: Sample) -> None:
        if self._last is not None:
            for missing in range(self._last.cycle + 1, sample.cycle):
                self._append(self._stand_in(self._last, missing))
        self._append(sample)
        self._last = sample

    def _stand_in(self, last: Sample, cycle: int) -> Sample:
        """Build the sample of a cycle that did not take place: the last values, flagged."""
        stand_in = replace(
            last,
            cycle=cycle,
            time_s=self._seconds(cycle - self._phase_from),
            age_ns=last.age_ns + (cycle - last.cycle) * self.pacer.period_ns,
            flags=last.flags | SLEPT_THROUGH,
        )
        return unread(stand_in)

    def _append(self, sample: Sample) -> None:
        self.recorder.append(sample)
        self._summary.recorded += 1
        self._summary.flagged += bool(sample.flags)
        self._show(sample)

    def _show(self, sample: Sample) -> None:
        for observer in self.observers:
            observer(sample, self._phase)

    def _seconds(self, cycles: int) -> float:
        """Time of a number of cycles [s]; one division, so that 7 times 10 ms is 0.07 exactly."""
        return cycles * self.pacer.period_ns / NS_PER_S
