"""Supervision of a run: one record of each cycle, one place that ends it; the table of rules is docs/reliability.md.

A rule with a size has a tolerance and a time. While a reading is outside its tolerance, its distance from what is
expected is summed over time, and the run ends where the sum reaches tolerance times time: 31 Nm with a tolerance of
30 Nm for 0.12 s, 300 Nm within two cycles, and a burst that comes again and again as soon as they add up to as much.
What has been summed is forgotten evenly over `FORGOTTEN_S` of readings within their tolerance.

A torque is expected within the range of the commands of the last response time and of the two cycles in which it may
be sampled (opendbc's ``dist_to_meas_check``): a drive is between where it was and where it is sent. Two readings of
the one shaft may differ by `SPEED_NOISE_RAD_S`, one count of each, `SPEED_SHARE` of the greater, and what the speed
changes within two periods, now or usually: by so much one may have been sampled earlier than the other.

No clock, bus or thread here: time comes in as nanoseconds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from drivers.errors import DeviceFault, DeviceTimeout, DriverError, WrongTorque
from drivers.guard_limits import NS_PER_S, GuardLimits
from drivers.inverter.cia402 import FAULT_STATES, Command, PowerState, TorqueMode
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.settings import InverterSettings

FORGOTTEN_S: Final = 10.0  # what has been summed up to its limit is forgotten in this time [s]

SPEED_NOISE_RAD_S: Final = 0.5
"""Ten times the noise of a resolver's speed, 0.05 rad/s: two such readings do not differ by it by chance."""

SPEED_SHARE: Final = 0.05  # of the greater reading: filters, and the ripple of a resolver

NO_TORQUE_S: Final = 1.0
"""So long a drive may be held at no torque by a limit of its own, at an error of the tolerance [s]."""

NO_TORQUE_COUNTS: Final = 2
"""Of 0x6077, a thousandth of rated torque each: the reading of a motor without torque, with its noise."""

MOST_SURPLUS: Final = 3
"""So many TPDOs more than SYNCs end a run: a controller may hear one frame twice (ISO 11898, last bit of EOF)."""

SURPLUS_CYCLES: Final = 100  # after so many cycles one that was too many is forgotten

MOST_MISSING: Final = 25
"""Cycles without a TPDO more than with one: a drive that answers less than every second SYNC, within 1 s at 10 ms."""

CHANGE_CYCLES: Final = 8.0
"""Over which the usual change of a speed from one cycle to the next is taken: noise changes it at every cycle."""

RUNAWAY_RAD_S: Final = 2.0
"""Change of speed that a torque must have been able to give before it is compared [rad/s]; four times the noise."""

RUNAWAY_SHARE: Final = 0.5
"""Of that change, the other way and away from standstill: the torque drives the vehicle against its sign."""

SWING_S: Final = 0.2
"""Low-pass of the speed that is compared [s]: after a step of torque the motor swings on its shaft, faster than it."""

UNWOUND_S: Final = 3.0 * SWING_S
"""From the first reading and each turn of the torque on [s], in which nothing is compared: the shaft unwinds, and the
low-passed speed is the vehicle's only when that has faded."""


def left_operation(where: str, state: PowerState) -> str:
    """Say that a drive is not in the state it was armed in."""
    return (
        f"{where}: power state is {state.value} after controlword 0x{Command.ENABLE_OPERATION.value:04X} (enable "
        "operation), expected operation enabled. The drive left it by itself, without a fault: look at its enable "
        "inputs, limit switches and safe torque off. It is not enabled again in this run."
    )


def speed_tolerance_rad_s(one_rad_s: float, other_rad_s: float, counts_rad_s: float) -> float:
    """Give how far two readings of one shaft at one time may be from each other [rad/s]."""
    return SPEED_NOISE_RAD_S + counts_rad_s + SPEED_SHARE * max(abs(one_rad_s), abs(other_rad_s))


def most_late(guard: GuardLimits) -> int:
    """Give how many answers may still come: an older one is too old for another rule."""
    return round(guard.feedback_timeout_s / guard.period_s)


class DriveRecord(NamedTuple):
    """One drive in one cycle: its command, its answer (None without), TPDOs of its seldomest and commonest kind."""

    commanded_nm: float  # target plus offset [Nm]
    feedback: InverterFeedback | None  # None where none came in this cycle
    fewest: int = 1  # TPDOs of the kind that came most seldom
    most: int = 1  # TPDOs of the kind that came most often


class CycleRecord(NamedTuple):
    """One cycle, as everything is judged by it."""

    t_ns: int  # of its SYNC, host's monotonic clock [ns]
    m1: DriveRecord  # first inverter
    m2: DriveRecord  # second inverter


@dataclass(frozen=True, slots=True)
class SupervisionLimits:
    """What the rules of one rig need: its guard's limits, a count of each speed [rad/s], the inertia [kg m²]."""

    guard: GuardLimits  # of the rig file
    count_m1_rad_s: float = 0.0  # one count of m1's 0x606C [rad/s]
    count_m2_rad_s: float = 0.0  # one count of m2's [rad/s]
    inertia_kg_m2: float | None = None  # of line and vehicle at the motor shaft; None where it is not known


class Excess:
    """The distances beyond a tolerance, summed over time (Nm s, rad)."""

    __slots__ = ("_at_ns", "_forgets", "_limit", "_period_ns", "_sum", "tolerance")

    def __init__(self, tolerance: float, time_s: float, period_s: float) -> None:
        self.tolerance = tolerance
        self._limit = tolerance * time_s * NS_PER_S * (1.0 - 1e-9)
        self._forgets = self._limit / (FORGOTTEN_S * NS_PER_S)
        self._period_ns = round(period_s * NS_PER_S)
        self._sum = 0.0
        self._at_ns = 0

    def take(self, t_ns: int, distance: float) -> bool:
        """Take a distance beyond the tolerance; tell whether that is too much."""
        within_ns = max(0, t_ns - self._at_ns - self._period_ns)
        self._sum = max(0.0, self._sum - within_ns * self._forgets) + distance * self._period_ns
        self._at_ns = t_ns
        return self._sum >= self._limit

    def clear(self) -> None:
        """Forget what was summed."""
        self._sum = 0.0


class _Torque:
    """One torque, or the sum of both, against the range of its commands."""

    __slots__ = ("_commands", "_width", "excess", "late")

    def __init__(self, tolerance_nm: float, guard: GuardLimits) -> None:
        self._width = max(1, round(guard.error.response_s / guard.period_s)) + 2
        self._commands: deque[float] = deque(maxlen=self._width + most_late(guard))
        self.late = 0
        self.excess = Excess(tolerance_nm, guard.error.time_s, guard.period_s)

    def command(self, commanded_nm: float, late: int) -> None:
        """Take the command of a cycle; answers to so many cycles are still to come."""
        self._commands.append(commanded_nm)
        self.late = late

    def commands(self) -> tuple[float, ...]:
        """Give the commands that the next answer may be to."""
        return tuple(self._commands)[-self._width - self.late :]

    def distance(self, torque_nm: float, limited: bool) -> float:
        """Give how far a torque is outside the range; 0 within the tolerance."""
        commands = self.commands()
        tolerance = self.excess.tolerance
        if abs(torque_nm - commands[-1]) <= tolerance:
            return 0.0
        low, high = min(commands), max(commands)
        if limited:
            low, high = min(low, 0.0), max(high, 0.0)
        distance = max(low - torque_nm, torque_nm - high)
        return distance if distance > tolerance else 0.0

    def range(self) -> str:
        """Give the range in words."""
        low, high = min(self.commands()), max(self.commands())
        return f"{low:g} Nm" if low == high else f"{low:g} to {high:g} Nm"


class _Drive:
    """The rules that one drive is judged by."""

    def __init__(self, settings: InverterSettings, guard: GuardLimits, tolerance_nm: float) -> None:
        self.where = settings.where
        self.name = settings.name
        self._mode = settings.mode.title
        self._no_torque_nm = NO_TORQUE_COUNTS * settings.rated_torque_nm / 1000.0
        self._state_timeout_s = settings.state_timeout_s
        self._watches_follow = settings.mode is TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE and settings.follow_bit
        self._guard = guard
        self.torque = _Torque(tolerance_nm, guard)
        self._stale = Excess(tolerance_nm, guard.feedback_timeout_s, guard.period_s)
        self._held = Excess(tolerance_nm, NO_TORQUE_S, guard.period_s)
        self.feedback: InverterFeedback | None = None
        self.answered_ns: int | None = None
        self.fresh_ns = 0
        self.repeats = False
        self.doubtful = False
        self.faults: list[str] = []
        self.wrong_torque = ""
        self.change_rad_s = self._usual_rad_s = 0.0
        self.followed = not self._watches_follow
        self._ignored_ns: int | None = None
        self._asked = False
        self._fresh_nm = 0.0
        self._surplus = self._missing = self._cycles = 0
        self._late_ns: deque[int] = deque(maxlen=most_late(guard))

    def take(self, t_ns: int, seen: DriveRecord) -> None:
        """Judge one cycle of this drive alone."""
        self.doubtful = False
        if seen.fewest != 1 or seen.most != 1 or self._surplus or self._missing or self._late_ns:
            self._count(t_ns, seen)
        self.torque.command(seen.commanded_nm, len(self._late_ns))
        feedback = seen.feedback
        if feedback is None:
            return
        if feedback.state is not PowerState.OPERATION_ENABLED:
            self._left(feedback.state)
        if self._watches_follow and not (feedback.follows and self.followed):
            self._follow(t_ns, feedback.follows, seen.commanded_nm)
        before, self.feedback, self.answered_ns = self.feedback, feedback, t_ns
        self.repeats = (
            before is not None and feedback.torque_raw == before.torque_raw and feedback.speed_raw == before.speed_raw
        )
        change_rad_s = 0.0 if before is None else abs(feedback.speed_rad_s - before.speed_rad_s)
        self._usual_rad_s += (change_rad_s - self._usual_rad_s) / CHANGE_CYCLES
        self.change_rad_s = max(change_rad_s, self._usual_rad_s)
        if self.repeats:
            self._repeated(t_ns, feedback, seen.commanded_nm)
        else:
            self._fresh_nm, self.fresh_ns = seen.commanded_nm, t_ns
            self._stale.clear()
        distance = self.torque.distance(feedback.torque_nm, feedback.limited)
        if distance and not (self.repeats and self.moves):
            self.doubtful = True
            if self.torque.excess.take(t_ns, distance):
                self._wrong(feedback)
        if feedback.limited:
            self._limited(t_ns, feedback.torque_nm, seen.commanded_nm)

    @property
    def moves(self) -> bool:
        """Whether the command has changed of late: a reading that repeats is then an old one, and says nothing."""
        commands = self.torque.commands()
        return min(commands) != max(commands)

    def _count(self, t_ns: int, seen: DriveRecord) -> None:
        self._cycles += 1
        late_ns = self._late_ns
        while late_ns and t_ns - late_ns[0] > self._guard.feedback_timeout_s * NS_PER_S:
            late_ns.popleft()  # it is lost
        extra = max(seen.most - 1, 0)
        came = min(extra, len(late_ns))  # of any kind: two of one SYNC may come in two cycles
        self.doubtful |= extra > came
        for _ in range(came):
            late_ns.popleft()
        if not seen.fewest:
            late_ns.append(t_ns)
        self._surplus += extra - came
        self._missing = max(self._missing + (-1 if seen.fewest else 1), 0)
        if self._surplus >= MOST_SURPLUS or self._missing >= MOST_MISSING:
            got = f"{self._surplus} TPDOs more than SYNCs" if self._surplus > 0 else "TPDOs missing at most SYNCs"
            self.faults.append(
                f"{self.where}: {got} in the last {self._cycles} cycles, expected one TPDO per SYNC. Look for another "
                "producer of SYNC or of this TPDO, its transmission type, and a bus without room; a simulated one "
                "answers late on a busy machine."
            )
        if self._cycles >= SURPLUS_CYCLES:
            self._cycles, self._surplus = 0, max(0, self._surplus - 1)

    def _left(self, state: PowerState) -> None:
        self.doubtful = True
        if state not in FAULT_STATES:  # whose cause the drive says itself: `Inverter.raise_if_faulted`
            self.faults.append(left_operation(self.where, state))

    def _follow(self, t_ns: int, follows: bool, commanded_nm: float) -> None:
        if follows:
            self.followed, self._ignored_ns = True, None
            return
        if commanded_nm and not self._asked:
            self._asked, self._ignored_ns = True, t_ns
        self._ignored_ns = t_ns if self._ignored_ns is None else self._ignored_ns
        self.doubtful = self.followed or self._asked
        patience_s = self._guard.error.time_s if self.followed or self._asked else self._state_timeout_s
        if t_ns - self._ignored_ns >= patience_s * NS_PER_S:
            self.faults.append(self._ignores())

    def _ignores(self) -> str:
        return (
            f"{self.where}: statusword 0x6041 bit 12 is 0, expected 1: in mode {self._mode} the drive ignores the "
            "target torque. Look for what holds it (enable inputs, safe torque off, limits); for a drive that has no "
            "such bit write follow_bit = false into the rig file."
        )

    def _repeated(self, t_ns: int, feedback: InverterFeedback, commanded_nm: float) -> None:
        moved_nm = abs(commanded_nm - self._fresh_nm)
        if moved_nm > self._stale.tolerance and self._stale.take(t_ns, moved_nm):
            self.faults.append(self.stands_still(feedback, f"the command moved by up to {moved_nm:g} Nm"))

    def stands_still(self, feedback: InverterFeedback, while_: str) -> str:
        """Say that feedback does not change any more."""
        return (
            f"{self.where}: feedback stands still at torque 0x6077 = {feedback.torque_raw} and speed 0x606C = "
            f"{feedback.speed_raw} counts while {while_}, expected readings that follow. The drive sends old values: "
            "check its program, and power-cycle it."
        )

    def _wrong(self, feedback: InverterFeedback) -> None:
        if self._watches_follow and not feedback.follows:
            self.faults.append(self._ignores())
            return
        self.wrong_torque = (
            f"inverter {self.name}: torque actual value 0x6077 is {feedback.torque_nm:g} Nm, expected "
            f"{self.torque.range()} as commanded, within {self.torque.excess.tolerance:g} Nm (torque_error_nm)"
        )

    def _limited(self, t_ns: int, torque_nm: float, commanded_nm: float) -> None:
        missing_nm = abs(commanded_nm) - abs(torque_nm)
        if (
            abs(torque_nm) <= self._no_torque_nm
            and missing_nm > self._held.tolerance
            and self._held.take(t_ns, missing_nm)
        ):
            self.faults.append(
                f"{self.where}: statusword 0x6041 bit 11 (internal limit) is set and the torque 0x6077 is "
                f"{torque_nm:g} Nm, expected some of the {commanded_nm:g} Nm commanded. A limit of the drive holds "
                "all of it back: look at its temperature, DC link and limits."
            )


class Supervision:
    """Judges every cycle of one run."""

    def __init__(self, limits: SupervisionLimits, m1: InverterSettings, m2: InverterSettings) -> None:
        guard = limits.guard
        self._limits = limits
        self._m1 = _Drive(m1, guard, guard.error.m1_nm)
        self._m2 = _Drive(m2, guard, guard.error.m2_nm)
        self._both = _Torque(guard.error.sum_nm, guard)
        self._counts_rad_s = limits.count_m1_rad_s + limits.count_m2_rad_s
        self._stale_ns = guard.feedback_timeout_s * NS_PER_S
        self._apart: Excess | None = None
        self._opposing_nm = self._could_rad_s = 0.0
        self._unturned_s = 0.0
        self._smooth: tuple[float, float] | None = None
        self._from: tuple[float, float, float] | None = None
        self._first_ns: int | None = None
        self.ended: DriverError | None = None

    @property
    def ready(self) -> bool:
        """Whether both have answered and follow their target torques."""
        return all(each.feedback is not None and each.followed for each in (self._m1, self._m2))

    def take(self, record: CycleRecord) -> tuple[bool, bool]:
        """Judge one cycle; tell of each drive whether its readings are doubtful. What ends the run is in `ended`."""
        m1, m2 = self._m1, self._m2
        m1.take(record.t_ns, record.m1)
        m2.take(record.t_ns, record.m2)
        late = max(m1.torque.late, m2.torque.late)
        self._both.command(record.m1.commanded_nm + record.m2.commanded_nm, late)
        one, other = record.m1.feedback, record.m2.feedback
        sum_fault = ""
        if one is not None and other is not None:
            self._compare_speeds(record.t_ns, one, other)
            sum_fault = self._compare_sum(record, one, other)
            self._compare_motion(one, other)
        if self.ended is None and (m1.faults or m2.faults or m1.wrong_torque or m2.wrong_torque or sum_fault):
            self._end(sum_fault)
        return m1.doubtful, m2.doubtful

    def _end(self, sum_fault: str) -> None:
        if faults := self._m1.faults + self._m2.faults:
            self.ended = DeviceFault("; ".join(dict.fromkeys(fault.rstrip(".") for fault in faults)) + ".")
            return
        wrong = "; ".join(filter(None, (self._m1.wrong_torque, self._m2.wrong_torque, sum_fault)))
        self.ended = WrongTorque(
            f"{wrong}. The drive does not give what it is asked for: compare its rated torque, scale, sign and limits "
            "with the rig file, and see that its RPDO arrives. For one that follows more slowly set [guard] "
            "torque_response_s."
        )

    def _compare_sum(self, record: CycleRecord, one: InverterFeedback, other: InverterFeedback) -> str:
        if one.limited or other.limited:
            return ""
        distance = self._both.distance(one.torque_nm + other.torque_nm, limited=False)
        if not distance or any(each.repeats and each.moves for each in (self._m1, self._m2)):
            return ""
        self._m1.doubtful = self._m2.doubtful = True
        if not self._both.excess.take(record.t_ns, distance):
            return ""
        return (
            f"both inverters: torque actual value 0x6077 is {one.torque_nm + other.torque_nm:g} Nm, expected "
            f"{self._both.range()} as commanded, within {self._both.excess.tolerance:g} Nm (torque_error_sum_nm): m1 "
            f"{one.torque_nm:g} for {record.m1.commanded_nm:g} Nm, m2 {other.torque_nm:g} for "
            f"{record.m2.commanded_nm:g} Nm"
        )

    def _compare_speeds(self, t_ns: int, one: InverterFeedback, other: InverterFeedback) -> None:
        difference = abs(one.speed_rad_s - other.speed_rad_s)
        if difference <= SPEED_NOISE_RAD_S:
            return
        m1, m2 = self._m1, self._m2
        tolerance = speed_tolerance_rad_s(one.speed_rad_s, other.speed_rad_s, self._counts_rad_s)
        tolerance += 2.0 * min(m1.change_rad_s, m2.change_rad_s)
        if difference <= tolerance or any(t_ns - each.fresh_ns in range(1, round(self._stale_ns)) for each in (m1, m2)):
            return
        m1.doubtful = m2.doubtful = True
        guard = self._limits.guard
        if self._apart is None:
            self._apart = Excess(SPEED_NOISE_RAD_S, guard.error.time_s, guard.period_s)
        # in units of its tolerance, which grows with the speed
        if self._apart.take(t_ns, difference * SPEED_NOISE_RAD_S / tolerance):
            stopped = [each for each in (m1, m2) if each.repeats and each.feedback is not None]
            m1.faults += [
                each.stands_still(each.feedback, "the other drive reads a speed that changes")
                for each in stopped
                if each.feedback is not None
            ]
            m1.faults.append(
                f"inverters m1 and m2: velocity actual value 0x606C is {one.speed_rad_s:.3g} rad/s at m1 and "
                f"{other.speed_rad_s:.3g} rad/s at m2, expected one speed within {tolerance:.2g} rad/s, for both read "
                "one shaft. Compare sign, unit (0x60A9) and gear of both, their resolvers, and their node ids."
            )

    def _compare_motion(self, one: InverterFeedback, other: InverterFeedback) -> None:
        """See whether the speed runs away against the torque: speeds or torques are reversed."""
        inertia = self._limits.inertia_kg_m2
        if inertia is None:
            return
        torque_nm, period_s = one.torque_nm + other.torque_nm, self._limits.guard.period_s
        self._unturned_s = 0.0 if torque_nm * self._opposing_nm < 0.0 else self._unturned_s + period_s
        self._opposing_nm = torque_nm
        self._could_rad_s += abs(torque_nm) * period_s / inertia
        speed, could = self._smooth or (one.speed_rad_s, self._could_rad_s)
        taken = 1.0 - math.exp(-period_s / SWING_S)
        speed += taken * (one.speed_rad_s - speed)
        could += taken * (self._could_rad_s - could)  # as late as the speed that it is compared with
        self._smooth = speed, could
        if self._from is None or self._unturned_s < UNWOUND_S or torque_nm * speed >= 0.0:
            self._from = speed, could, self._could_rad_s
            return
        from_rad_s, could_from, whole_from = self._from
        since_rad_s = self._could_rad_s - whole_from
        if since_rad_s < RUNAWAY_RAD_S:
            return
        if abs(speed) - abs(from_rad_s) > RUNAWAY_SHARE * (could - could_from):
            self._m1.faults.append(
                f"inverters m1 and m2: the speed went from {from_rad_s:.3g} to {speed:.3g} rad/s "
                f"against a torque of {torque_nm:g} Nm, expected it slower by up to {since_rad_s:.2g} rad/s. Compare "
                "the signs of torque and speed of both drives with the rig file; on a grade the vehicle rolls away."
            )
        self._from = speed, could, self._could_rad_s

    def ages_ns(self, now_ns: int) -> tuple[int, int]:
        """Ages of the last answers of m1 and m2, from the first look on while there is none [ns]."""
        if self._first_ns is None:
            self._first_ns = now_ns
        first_ns = self._first_ns
        return (
            now_ns - (first_ns if self._m1.answered_ns is None else self._m1.answered_ns),
            now_ns - (first_ns if self._m2.answered_ns is None else self._m2.answered_ns),
        )

    def raise_if_ended(self) -> None:
        """Raise what ended the run, if anything has."""
        if self.ended is not None:
            raise self.ended

    def raise_if_old(self, ages_ns: Sequence[int]) -> None:
        """Refuse feedback that is too old."""
        for drive, age_ns in zip((self._m1, self._m2), ages_ns, strict=True):
            if age_ns > self._stale_ns:
                raise DeviceTimeout(
                    f"inverter {drive.name}: no TPDO for {age_ns / NS_PER_S:.3f} s, expected one per SYNC and none "
                    f"missing for more than {self._stale_ns / NS_PER_S:g} s (feedback_timeout_s). Check its supply "
                    "and its cabling; a simulated one answers late on a busy machine."
                )
