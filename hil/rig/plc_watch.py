"""Watch the PLC during a run without delaying the torque cycle.

A poll is started when it is due and its result is taken at a later cycle; only a run without a wall clock
waits for it, since simulated time would run away from the PLC otherwise. Ages count in the cycle's time,
from the start of the poll.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace

from drivers.errors import DriverError
from drivers.plc.plc import Plc
from drivers.plc.types import PlcStatus
from hil.errors import RunAborted
from hil.rig.fitness import Needs, changes
from hil.rig.pacing import NS_PER_S, Tick
from hil.rig.plc_loop import PlcLoop
from hil.sample import SampleFlag

POLL_EVERY_NS = NS_PER_S // 10
"""Time between two polls [ns]: a clutch takes longer than this to close."""

SILENT_AFTER_NS = NS_PER_S
"""Without an answer for so long the PLC counts as silent [ns]: ten polls, and its client's own time-out."""


class PlcWatch:
    """The PLC's life signs and its permission to drive, looked at in every cycle.

    Parameters
    ----------
    loop
        Where the PLC's client runs.
    plc
        The client, connected.
    before
        What the PLC reported when the run was prepared; it was fit for `needs`.
    needs
        What the run needs of the vehicle.
    patience_s
        How long a cycle may wait for a poll [s]; 0 on a wall clock.
    """

    def __init__(self, loop: PlcLoop, plc: Plc, before: PlcStatus, needs: Needs, patience_s: float) -> None:
        self._loop = loop
        self._plc = plc
        self._before = before
        self._latest = before
        self._needs = needs
        self._patience_s = patience_s
        self._poll: Future[PlcStatus] | None = None
        self._asked_ns: int | None = None
        self._news: PlcStatus | None = None

    @property
    def status(self) -> PlcStatus:
        """Latest report, its ``t_ns`` in the cycle's time from the first cycle on."""
        return self._latest

    @property
    def news(self) -> PlcStatus | None:
        """The report that came in the present cycle, if one did."""
        return self._news

    def look(self, tick: Tick, *speeds_rad_s: float) -> SampleFlag:
        """Poll if it is due, and judge what is known."""
        if self._asked_ns is None:  # what was reported before the run counts from here
            self._latest = replace(self._latest, t_ns=tick.now_ns)
        self._start_if_due(tick.now_ns)
        self._news = self._take_answer()
        self._latest = self._news or self._latest
        age_ns = self._latest.age_ns(tick.now_ns)
        if age_ns > SILENT_AFTER_NS:
            raise RunAborted(
                f"PLC: no answer for {age_ns / NS_PER_S:.2f} s, expected one every "
                f"{POLL_EVERY_NS / NS_PER_S:g} s. Check that its program runs and its network is up."
            )
        self._judge(speeds_rad_s)
        return SampleFlag.PLC_STALE if age_ns > 2 * POLL_EVERY_NS else SampleFlag.GOOD

    def _start_if_due(self, now_ns: int) -> None:
        due = self._asked_ns is None or now_ns - self._asked_ns >= POLL_EVERY_NS
        if self._poll is None and due:
            self._poll = self._loop.start(self._beat_and_read())
            self._asked_ns = now_ns

    async def _beat_and_read(self) -> PlcStatus:
        await self._plc.beat()
        return await self._plc.read_status()

    def _take_answer(self) -> PlcStatus | None:
        """Take what a poll has brought, as old as the poll; the PLC's client stamps with a clock of its own."""
        if self._poll is None or self._asked_ns is None:
            return None
        try:
            status = self._poll.result(self._patience_s)
        except DriverError as error:
            raise RunAborted(f"PLC: expected its status, got: {error}") from error
        except TimeoutError:
            return None  # under way; its age speaks when it takes too long
        self._poll = None
        return replace(status, t_ns=self._asked_ns)

    def _judge(self, speeds_rad_s: Sequence[float]) -> None:
        reasons = list(changes(self._before, self._latest, self._needs))
        if any(abs(speed_rad_s) > self._latest.speed_limit_rad_s for speed_rad_s in speeds_rad_s):
            read = " and ".join(f"{speed_rad_s:.1f}" for speed_rad_s in speeds_rad_s)  # one may read a speed long past
            reasons.append(f"speed is {read} rad/s, expected at most {self._latest.speed_limit_rad_s:g} rad/s")
        if reasons:
            raise RunAborted(f"PLC: {'; '.join(reasons)}. The run was ended at zero torque; fix the cause, run again.")
