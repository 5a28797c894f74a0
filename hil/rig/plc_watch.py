"""Watch the PLC during a run without delaying the torque cycle: whether what it reports may be driven, and its limits.

A poll is started when it is due and its result is taken at a later cycle; only a run without a wall clock
waits for it, since simulated time would run away from the PLC otherwise. Ages count in the cycle's time,
from the start of the poll.

Identification needs the series or electric mode with the clutch open: with it closed the combustion engine
turns with the motor shaft, and the driveline is another one.

A register map with a torque limit ten times too high, or a speed limit in another unit, can't be seen from one reading:
the limits are put into words, for someone who knows the vehicle to confirm. Beyond `MOST_OF_RATED` times a drive's own
rated value a limit limits nothing, and is refused: a traction drive gives two to three times its rated torque for a
short time, and its field weakening ends at about three times its base speed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

from drivers.errors import ConfigMismatch, DriverError
from drivers.inverter.inverter import Inverter
from drivers.plc.plc import Plc
from drivers.plc.types import ClutchState, DriveMode, PlcStatus
from hil.config.rig_file import Rig
from hil.errors import RunAborted
from hil.rig.pacing import NS_PER_S, Tick
from hil.rig.plc_loop import PlcLoop
from hil.sample import SampleFlag

FIT_MODES = (DriveMode.SERIES, DriveMode.ELECTRIC)

POLL_EVERY_NS = NS_PER_S // 10
"""Time between two polls [ns]: a clutch takes longer than this to close."""

SILENT_AFTER_NS = NS_PER_S
"""Without an answer for so long the PLC counts as silent [ns]: ten polls, and its client's own time-out."""

MOST_OF_RATED: Final = 3.0
"""A limit of the PLC beyond so many times the drives' rated value is refused."""

MAX_MOTOR_SPEED: Final = (0x6080, 0)
"""Of CiA 402 [rpm]; few drives have it."""

RPM: Final = 2.0 * math.pi / 60.0


@dataclass(frozen=True, slots=True)
class Needs:
    """What a run needs of the vehicle: the largest torque it asks of one inverter, PRBS included [Nm]."""

    torque_of_one_nm: float  # compared with the torque limit that the PLC reports


def reasons_against(status: PlcStatus, needs: Needs) -> Iterator[str]:
    """Name everything that speaks against driving; nothing if the vehicle is fit."""
    if status.drive_mode not in FIT_MODES:
        wanted = " or ".join(mode.value for mode in FIT_MODES)
        yield f"drive mode is {status.drive_mode.value}, expected {wanted}"
    if status.clutch is not ClutchState.OPEN:
        yield f"clutch is {status.clutch.value}, expected open"
    if not status.permissive:
        yield "permissive is withdrawn, expected present"
    if status.torque_limit_nm < needs.torque_of_one_nm:
        yield (
            f"torque limit of one inverter is {status.torque_limit_nm:g} Nm, expected at least the "
            f"{needs.torque_of_one_nm:g} Nm this experiment may ask for"
        )


def changes(before: PlcStatus, status: PlcStatus, needs: Needs) -> Iterator[str]:
    """Name everything that speaks against driving on, given what was reported when the run began."""
    yield from reasons_against(status, needs)
    if status.drive_mode in FIT_MODES and status.drive_mode is not before.drive_mode:
        yield f"drive mode is {status.drive_mode.value}, expected {before.drive_mode.value} as at the start"


class PlcWatch:
    """The PLC's life signs and its permission to drive, looked at in every cycle."""

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


@dataclass(frozen=True, slots=True)
class PlcLimit:
    """One limit that the PLC reports."""

    what: str  # its name
    question: str  # it and what it is to be compared with, in words
    found: str  # what the PLC reports, with its unit
    most: str | None  # the largest that is believed, with its unit; None where nothing is known to compare with
    believed: bool  # whether it is within that


def max_speed_rad_s(inverter: Inverter) -> float | None:
    """Read a drive's own largest speed [rad/s]; None where it has none."""
    with suppress(ConfigMismatch):
        return inverter.read_channel(MAX_MOTOR_SPEED) * RPM or None
    return None


def plc_limits(status: PlcStatus, rig: Rig, drives_rad_s: float | None) -> Iterator[PlcLimit]:
    """Put each limit into words."""
    tables = (rig.inverters.m1, rig.inverters.m2)
    rated_nm = max(table.rated_torque_nm for table in tables)
    asked_nm = max(table.torque_limit_nm for table in tables)
    yield PlcLimit(
        "torque limit",
        f"the PLC allows {status.torque_limit_nm:,g} Nm of one inverter; the drives are rated {rated_nm:,g} Nm, the "
        f"rig file asks for {asked_nm:,g} Nm at most: right?",
        f"{status.torque_limit_nm:,g} Nm",
        f"{MOST_OF_RATED * rated_nm:,g} Nm, {MOST_OF_RATED:g} times rated torque",
        status.torque_limit_nm <= MOST_OF_RATED * rated_nm,
    )
    own = {"the drives": drives_rad_s, "the rig file": rig.guard.speed_limit_rad_s}
    known = {who: limit for who, limit in own.items() if limit is not None}
    others = "".join(f"; {who} {_speed(limit)}" for who, limit in known.items())
    most = MOST_OF_RATED * min(known.values()) if known else None
    yield PlcLimit(
        "speed limit",
        f"the PLC allows {_speed(status.speed_limit_rad_s)} of the motor shaft{others}: right?",
        _speed(status.speed_limit_rad_s),
        None if most is None else f"{_speed(most)}, {MOST_OF_RATED:g} times the drives' or the rig file's own",
        most is None or status.speed_limit_rad_s <= most,
    )


def _speed(rad_s: float) -> str:
    return f"{rad_s:,.4g} rad/s ({rad_s / RPM:,.0f} rpm)"
