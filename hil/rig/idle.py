"""Listening: SYNC at the rig's period with both drives disarmed, so that a rig at rest can be watched.

The inverters are configured as for a run (PDO layout, heartbeat, option codes; NMT OPERATIONAL) and never armed:
their power stages stay off, no torque is commanded, no RPDO is sent. What does not answer is reported, not raised: a
drive may be switched on later. Only the loss of the bus itself ends it.
"""

from __future__ import annotations

import math
from concurrent.futures import Future
from dataclasses import dataclass

from drivers.errors import BusDown, DriverError
from drivers.inverter.inverter import Inverter, InverterFeedback
from drivers.plc.plc import Plc
from drivers.plc.reader import Backoff
from drivers.plc.types import PlcStatus
from hil.rig.build import Devices
from hil.rig.pacing import NS_PER_S, Pacer
from hil.rig.plc_loop import PlcLoop
from hil.rig.plc_watch import POLL_EVERY_NS
from hil.rig.timing import RunTiming
from hil.sample import Sample, SampleFlag

PLC_BACKOFF = Backoff(first_s=0.2, longest_s=2.0, attempts=8)
"""Pauses between attempts to reach a PLC that was lost; the longest one is kept to."""


@dataclass(slots=True)
class _IdleInverter:
    """One inverter, listened to: its last answer and when that came."""

    inverter: Inverter
    stale: SampleFlag
    latest: InverterFeedback | None = None
    trouble: str | None = None

    def configure(self) -> None:
        """Configure it and clear a fault it may be in; what goes wrong is kept in words."""
        self.latest, self.trouble = None, None
        try:
            self.inverter.configure()
        except BusDown:
            raise
        except DriverError as error:
            self.trouble = str(error)

    def take(self, feedback: InverterFeedback | None) -> SampleFlag:
        if feedback is None:
            return self.stale
        self.latest = feedback
        return SampleFlag.GOOD

    @property
    def torque_nm(self) -> float:
        return math.nan if self.latest is None else self.latest.torque_nm

    @property
    def speed_rad_s(self) -> float:
        return math.nan if self.latest is None else self.latest.speed_rad_s


class PlcPoll:
    """Asks for the PLC's status ten times a second while nothing depends on it, and connects again after a loss.

    The status itself is the client's `Plc.latest`; ``trouble`` says what keeps the next from coming.
    """

    def __init__(self, loop: PlcLoop, plc: Plc) -> None:
        self._loop = loop
        self._plc = plc
        self._poll: Future[PlcStatus] | None = None
        self._next_ns = 0
        self._pauses_s = PLC_BACKOFF.pauses_s()
        self.trouble: str | None = None

    def look(self, now_ns: int) -> None:
        """Ask if it is due, and take what has come; never waits."""
        if self._poll is None and now_ns >= self._next_ns:
            self._poll = self._loop.start(self._ask(again=self.trouble is not None))
        if self._poll is None or not self._poll.done():
            return
        poll, self._poll = self._poll, None
        self._next_ns = now_ns + POLL_EVERY_NS
        try:
            poll.result()
            self.trouble = None
            self._pauses_s = PLC_BACKOFF.pauses_s()
        except DriverError as error:
            self.trouble = str(error)
            self._next_ns = now_ns + round(next(self._pauses_s, PLC_BACKOFF.longest_s) * NS_PER_S)

    def finish(self) -> None:
        """Wait for an answer under way: a run that begins asks for itself, and connections carry one at a time."""
        if self._poll is not None:
            self._poll.exception()  # what it ends in does not matter any more; the drivers bound how long it takes
            self._poll = None

    async def _ask(self, again: bool) -> PlcStatus:
        if again:
            self._plc.close()
            await self._plc.connect()
        await self._plc.beat()
        return await self._plc.read_status()


class Listening:
    """The rig at rest, cycle by cycle."""

    def __init__(self, devices: Devices, pacer: Pacer, timing: RunTiming) -> None:
        self._link = devices.link
        self._channels = devices.channels
        self._pacer = pacer
        self._m1 = _IdleInverter(devices.m1, SampleFlag.M1_STALE)
        self._m2 = _IdleInverter(devices.m2, SampleFlag.M2_STALE)
        self._first: int | None = None
        self.timing = timing
        self.plc = PlcPoll(devices.plc_loop, devices.plc)

    @property
    def troubles(self) -> tuple[str | None, str | None]:
        """Why each inverter could not be configured; None where it was."""
        return self._m1.trouble, self._m2.trouble

    def begin(self) -> None:
        """Configure both inverters; one that is not there is listened for all the same."""
        for ear in (self._m1, self._m2):
            ear.configure()

    def reset_faults(self) -> tuple[str, ...]:
        """Reset the fault of each drive that is in one; what could not be reset, in words."""
        failures = []
        for ear in (self._m1, self._m2):
            try:
                if ear.inverter.fault() is not None:
                    ear.inverter.reset_fault()
            except BusDown:
                raise
            except DriverError as error:
                failures.append(str(error))
        return tuple(failures)

    def step(self) -> Sample:
        """Run one cycle: SYNC, and what answers it."""
        tick = self._pacer.next()
        self.plc.look(tick.now_ns)
        sync_ns = self._link.sync()
        self.timing.begin(tick, sync_ns)
        flags = SampleFlag.LATE if self.timing.is_late(tick) else SampleFlag.GOOD
        deadline_ns = sync_ns + round(self._pacer.answer_timeout_s * NS_PER_S)
        waited_ns = 0
        for ear in (self._m1, self._m2):
            left_s = max(0, deadline_ns - sync_ns - waited_ns) / NS_PER_S
            feedback = ear.inverter.await_feedback(sync_ns, left_s)
            waited_ns = deadline_ns - sync_ns if feedback is None else feedback.t_ns - sync_ns
            self.timing.answer(None if feedback is None else waited_ns)
            flags |= ear.take(feedback)
        channels = self._channels.read(sync_ns, max(0, deadline_ns - sync_ns - waited_ns) / NS_PER_S)
        if any(map(math.isnan, channels)):
            flags |= SampleFlag.CHANNEL_LOST
        first = tick.cycle if self._first is None else self._first
        self._first = first
        return Sample(
            cycle=tick.cycle,
            t_ns=sync_ns,
            time_s=(tick.cycle - first) * self._pacer.period_ns / NS_PER_S,
            torque_ref_m1_nm=0.0,
            torque_ref_m2_nm=0.0,
            prbs_nm=0.0,
            torque_m1_nm=self._m1.torque_nm,
            torque_m2_nm=self._m2.torque_nm,
            speed_rad_s=self._m1.speed_rad_s,
            age_ns=sync_ns - min(self._answered_ns(ear, sync_ns) for ear in (self._m1, self._m2)),
            flags=flags,
            channels=channels,
        )

    def _answered_ns(self, ear: _IdleInverter, sync_ns: int) -> int:
        """Host time of its last answer [ns], at most that of the SYNC: what has answered it has no age."""
        return sync_ns if ear.latest is None else min(sync_ns, ear.latest.t_ns)
