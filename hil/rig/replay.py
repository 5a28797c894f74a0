"""From a bus trace back to the samples: the frames through the drivers' decoding, SYNC by SYNC.

One SYNC is one cycle. Its command is what the last RPDOs before it carried, its answer the TPDOs that came after it
in time. So torque and speed are those the run recorded, to the bit; the references are what was on the bus, whole
per mille of the rated torque, and the flags what the bus can tell: answers and cycles that were missing or late.

A trace whose SYNC come at less than half the rig's period is one of a run that waited for no clock: each SYNC is a
period then, and an answer is in time until the next one. Any other is laid on the schedule of `RealTimePacer`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import median

from drivers.canopen.can_link import SYNC_COB_ID, FrameCallback
from drivers.errors import ProtocolViolation
from drivers.inverter.pdos import InverterPdos
from drivers.inverter.settings import InverterSettings
from hil.config.channel_table import ChannelTable
from hil.config.rig_file import Rig
from hil.errors import RecordingError
from hil.rig.build import inverter_settings
from hil.rig.drive import SLEPT_THROUGH, unread
from hil.rig.pacing import NS_PER_S, answer_timeout_ns, period_ns, periods_used_up
from hil.rig.trace import read_frames
from hil.sample import Sample, SampleFlag

Frame = tuple[int, bytes, int]
"""Identifier, data and time [ns]."""

MOST_MISSED = 100_000
"""Cycles that may be missing in a trace: each becomes a flagged row."""

LOOKED_AT = 1000
"""SYNC by which it is judged whether the run waited for a clock."""


class _Station:
    """One inverter of the trace: the command before the next SYNC, the answer after the last one."""

    def __init__(self, settings: InverterSettings, stale: SampleFlag, limited: SampleFlag) -> None:
        self._pdos = InverterPdos(settings)
        self._receiver = self._pdos.receiver()
        self._channels = self._pdos.channel_receiver()
        self._stale, self._limited = stale, limited
        self._answered = False
        self._remark = SampleFlag.GOOD
        self.commands = {cob_id: partial(self._take_command, cob_id) for cob_id in self._pdos.rpdos}
        self.answers: list[tuple[int, FrameCallback]] = [
            *((cob_id, partial(self._take_answer, take)) for cob_id, take in self._receiver.subscriptions),
            *self._channels.subscriptions,
        ]
        self._target_nm, self._offset_nm = 0.0, 0.0 if self.has_offset else math.nan
        self.torque_ref_nm, self.prbs_nm = 0.0, 0.0
        self.torque_nm, self.speed_rad_s = math.nan, math.nan
        self.cycles_old = 0

    @property
    def has_offset(self) -> bool:
        """Whether base torque and PRBS can be distinguished."""
        return self._pdos.has_offset

    def _take_command(self, cob_id: int, data: bytes) -> None:
        torque = self._pdos.unpack(cob_id, data)
        self._target_nm = self._target_nm if torque.target_nm is None else torque.target_nm
        self._offset_nm = self._offset_nm if torque.offset_nm is None else torque.offset_nm

    def begin(self) -> None:
        self._receiver.start_anew()  # what several TPDOs share is all of this cycle
        self._channels.start_anew()
        if self.has_offset:
            self.torque_ref_nm, self.prbs_nm = self._target_nm + self._offset_nm, self._offset_nm
        else:  # the sum is all that was on the bus
            self.torque_ref_nm, self.prbs_nm = self._target_nm, math.nan
        self._answered = False

    def _take_answer(self, take: FrameCallback, data: bytes, t_ns: int) -> None:
        take(data, t_ns)
        feedback = self._receiver.latest
        if feedback is not None and not self._answered:
            self.torque_nm, self.speed_rad_s = feedback.torque_nm, feedback.speed_rad_s
            self._remark = self._limited if feedback.limited else SampleFlag.GOOD
            self._answered = True

    @property
    def channels(self) -> tuple[int | None, ...]:
        """Counts of the further objects of this cycle; None for one that did not come."""
        return self._channels.latest

    def end(self) -> SampleFlag:
        """Close the cycle; the flag it deserves."""
        self.cycles_old = 0 if self._answered else self.cycles_old + 1
        return self._remark if self._answered else self._stale


@dataclass(slots=True)
class _Clock:
    """Numbers the SYNC of a trace."""

    period_ns: int
    paced: bool
    _due_ns: int | None = None
    _cycle: int = 0

    def number(self, sync_ns: int) -> tuple[int, SampleFlag]:
        """Give a SYNC's cycle, and whether it was late."""
        due_ns = sync_ns if self._due_ns is None else self._due_ns
        late_ns = sync_ns - due_ns if self.paced else 0
        used_up = max(1, periods_used_up(late_ns, self.period_ns))
        cycle, self._cycle = self._cycle, self._cycle + used_up
        self._due_ns = due_ns + used_up * self.period_ns
        return cycle, SampleFlag.LATE if 2 * late_ns > self.period_ns else SampleFlag.GOOD

    def in_time(self, after_sync_ns: int) -> bool:
        """Whether an answer that came so long after its SYNC counts."""
        return not self.paced or after_sync_ns <= answer_timeout_ns(self.period_ns)


@dataclass(slots=True)
class _Reader:
    """Turns frames into samples; time counts in cycles from the first SYNC."""

    clock: _Clock
    m1: _Station
    m2: _Station
    tables: Sequence[ChannelTable]
    _sync_ns: int | None = None
    _cycle: int = 0
    _flags: SampleFlag = field(default=SampleFlag.GOOD)

    def samples(self, frames: Iterable[Frame]) -> Iterator[Sample]:
        commands = {**self.m1.commands, **self.m2.commands}
        answers: dict[int, list[FrameCallback]] = {}
        for of, take in (*self.m1.answers, *self.m2.answers):
            answers.setdefault(of, []).append(take)
        for cob_id, data, t_ns in frames:
            if cob_id == SYNC_COB_ID:
                yield from self._end()
                self._begin(t_ns)
            elif cob_id in commands:
                commands[cob_id](data)
            elif cob_id in answers and self._sync_ns is not None and self.clock.in_time(t_ns - self._sync_ns):
                for take in answers[cob_id]:
                    take(data, t_ns)
        yield from self._end()

    def _begin(self, sync_ns: int) -> None:
        self._sync_ns = sync_ns
        self._cycle, self._flags = self.clock.number(sync_ns)
        self.m1.begin()
        self.m2.begin()

    def _end(self) -> Iterator[Sample]:
        if self._sync_ns is None:
            return
        channels = tuple(self._channels())
        lost = SampleFlag.CHANNEL_LOST if any(map(math.isnan, channels)) else SampleFlag.GOOD
        flags = self._flags | self.m1.end() | self.m2.end() | lost
        yield Sample(
            cycle=self._cycle,
            t_ns=self._sync_ns,
            time_s=0.0,
            torque_ref_m1_nm=self.m1.torque_ref_nm,
            torque_ref_m2_nm=self.m2.torque_ref_nm,
            prbs_nm=self.m1.prbs_nm + self.m2.prbs_nm,
            torque_m1_nm=self.m1.torque_nm,
            torque_m2_nm=self.m2.torque_nm,
            speed_rad_s=self.m1.speed_rad_s,
            age_ns=max(self.m1.cycles_old, self.m2.cycles_old) * self.clock.period_ns,
            flags=flags,
            channels=channels,
        )

    def _channels(self) -> Iterator[float]:
        """Give the channels of this cycle; those of the PLC are not on this bus."""
        counts = {"m1": iter(self.m1.channels), "m2": iter(self.m2.channels)}
        for table in self.tables:
            count = None if table.inverter is None else next(counts[table.inverter])
            yield math.nan if count is None or table.scale is None else count * table.scale


def replay(path: Path, rig: Rig, whole: bool = False, channel: str | None = None) -> Iterator[Sample]:
    """Read the samples of a bus trace."""
    period = period_ns(rig.period_s)
    clock = _Clock(period, paced=_is_paced(path, period, channel))
    m1 = _Station(inverter_settings("m1", rig), SampleFlag.M1_STALE, SampleFlag.M1_LIMITED)
    m2 = _Station(inverter_settings("m2", rig), SampleFlag.M2_STALE, SampleFlag.M2_LIMITED)
    if not whole and not (m1.has_offset and m2.has_offset):
        raise RecordingError(
            path,
            "expected the PRBS in an object of its own (0x60B2), by which the measured part is known, got drives that "
            "get base torque and PRBS as one sum (0x6071). For every cycle: --all.",
        )
    every = _Reader(clock, m1, m2, rig.channels).samples(read_frames(path, channel))
    chosen = every if whole else _measured(path, every)
    try:
        yield from _evenly(path, chosen, period)
    except ProtocolViolation as error:
        raise RecordingError(path, f"{error} Or the rig file is not the one of this trace.") from error


def _is_paced(path: Path, period: int, channel: str | None) -> bool:
    """Whether the SYNC of a trace followed a clock."""
    every = (t_ns for cob_id, _, t_ns in read_frames(path, channel) if cob_id == SYNC_COB_ID)
    times = list(itertools.islice(every, LOOKED_AT + 1))
    if len(times) < 2:
        raise RecordingError(path, f"expected SYNC (0x{SYNC_COB_ID:03X}), got {len(times)}. Trace a run of cycles.")
    return 2 * median(after - before for before, after in itertools.pairwise(times)) >= period


def _measured(path: Path, samples: Iterable[Sample]) -> Iterator[Sample]:
    """Choose the cycles in which the PRBS runs: it is at one of its two levels there, and at zero outside."""
    stretches = 0
    for has_prbs, stretch in itertools.groupby(samples, key=lambda sample: sample.prbs_nm != 0.0):
        stretches += has_prbs
        if stretches > 1:
            raise RecordingError(path, "expected one measured part (PRBS, 0x60B2), got a second. Cut the trace.")
        if has_prbs:
            yield from stretch
    if not stretches:
        raise RecordingError(
            path, "expected a measured part (PRBS, 0x60B2, not zero), got none. For every cycle: --all."
        )


def _evenly(path: Path, samples: Iterable[Sample], period: int) -> Iterator[Sample]:
    """Count time from the first sample, and put flagged ones where cycles are missing."""
    first: int | None = None
    last: Sample | None = None
    missed = 0
    for sample in samples:
        first = sample.cycle if first is None else first
        if last is not None:
            missed += sample.cycle - last.cycle - 1
            if missed > MOST_MISSED:
                raise RecordingError(
                    path,
                    f"expected one run, got one without SYNC for {missed * period / NS_PER_S:.0f} s in all. Cut the "
                    "trace, or give the rig file whose period it has.",
                )
            for missing in range(last.cycle + 1, sample.cycle):
                age_ns = last.age_ns + (missing - last.cycle) * period
                stand_in = unread(replace(last, cycle=missing, age_ns=age_ns, flags=last.flags | SLEPT_THROUGH))
                yield _at(stand_in, first, period)
        yield _at(sample, first, period)
        last = sample


def _at(sample: Sample, first: int, period: int) -> Sample:
    return replace(sample, time_s=(sample.cycle - first) * period / NS_PER_S)
