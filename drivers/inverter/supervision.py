"""Supervision of a run: one record of each cycle, one place that ends it, one table of rules (`RULES`).

Each reading is compared with what `drivers.inverter.observer` predicts for it, in the cycle in which it comes: a drive
alone (`drivers.inverter.drive_supervision`), both together, and both as what moves the vehicle.

No clock, bus or thread here: time comes in as nanoseconds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Final, NamedTuple

from drivers.errors import DeviceFault, DeviceTimeout, DriverError, WrongTorque
from drivers.guard_limits import NS_PER_S, GuardLimits
from drivers.inverter.drive_supervision import (
    LOST_S,
    LOST_SHARE,
    MOST_SURPLUS,
    NO_TORQUE_S,
    SURPLUS_CYCLES,
    DriveRecord,
    DriveSupervision,
    Excess,
)
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.observer import Motion, VehicleObserver
from drivers.inverter.settings import InverterSettings
from drivers.inverter.vehicle import Vehicle

SPEED_NOISE_RAD_S: Final = 0.5
"""Ten times the noise of a resolver's speed, 0.05 rad/s: two such readings do not differ by it by chance."""

SPEED_SHARE: Final = 0.05  # of the greater reading: filters, and the ripple of a resolver
DEVIATIONS: Final = 3.0  # of an estimate, beyond which it has passed a bound

MOST_SURPRISE: Final = 15.0
"""Of the predicted speed: a difference of 16 deviations at once, or of four in each of five blocks. Of 1,900 vehicles
drawn as in tests/campaigns/healthy.py the worst came to 12.9, one in a hundred to 9; a speed that is reversed, halved
or zero comes at once to 50 and more."""

GAIN_SHARE: Final = 1.15
"""By so much acceleration over torque may be beyond what the inertias have: torque readings are 5 % off, and friction
that changes with the torque is taken for inertia. The same came to 2 deviations beyond it."""

MOST_HELD_RAD_S: Final = 1.0
"""That a speed which stands to the last bit should have changed by: the same came to 0.65, for half of their drives
show a speed below 0.3 rad/s as zero, after a reading with noise."""

PRBS_S: Final = 0.32
"""Over which both drives' parts of the PLC's PRBS are compared, by weights of exp(-age / it) [s]."""

PRBS_LAG_S: Final = 0.03  # by which one drive may be later than the other [s]

LEAST_CORRELATION: Final = 0.3
"""Of both drives' parts. A lag of 60 ms at one of them, and levels of 10 ms, leave 0.53 (levels in turn through a first
order: sqrt(a (2 - a)), a = 1 - exp(-10 / 60)); another sequence has a deviation of 0.25 at levels of 20 ms."""

MOST_EVEN: Final = 0.5
"""Mean square about the mean, in that of the PLC's levels, that one of both has at least where they are compared: what
lasts longer than `PRBS_S` says nothing until it changes."""

RULES: Final = f"""\
power state, 0x6041 | OPERATION ENABLED, in every mode | none | one TPDO | end; never enabled again
bit 12 of 0x6041 (mode 10) | 1 | none | `state_timeout_s` until it first is, then `torque_error_time_s` | flag, end
bit 11 of 0x6041 | 0, or a torque above `torque_error_nm` | `torque_error_nm` | tolerance × {NO_TORQUE_S:g} s | end
torque 0x6077 of a drive | its command by slope and `torque_response_s`, of the last three SYNCs; from 0 with bit 11 \
| `torque_error_nm` | tolerance × `torque_error_time_s` | flag, end
torques of both | the two predictions | `torque_error_sum_nm`, of both distances | tolerance × `torque_error_time_s` \
| flag, end
torques with the PLC's PRBS | the same, or between its levels; nothing while it is off | as above | as above | flag, end
the PLC's PRBS at both drives, where its turn would be an error | one sequence: a correlation of \
{LEAST_CORRELATION:g} | {1000 * PRBS_LAG_S:g} ms | {PRBS_S:g} s | end
reading that repeats to the last bit | the command of its first | `torque_error_nm` | tolerance × `feedback_timeout_s` \
| end
speeds 0x606C of both, low-passed | one speed | {SPEED_NOISE_RAD_S:g} rad/s, a count of each, {100 * SPEED_SHARE:g} % \
| tolerance × `torque_error_time_s` | flag, end
speed | what torque, inertia and a load that changes slowly make of it | differences of one sign over their \
deviations, less 1 each: {MOST_SURPRISE:g} | 0.1 s each | end
acceleration per torque | that of `inertia_empty_kg_m2` to `inertia_full_kg_m2` | {100 * GAIN_SHARE - 100:.0f} % and \
{DEVIATIONS:g} deviations | none | end
load | `most_grade`, and rolling | {DEVIATIONS:g} deviations | none | end
speed that stands to the last bit | no jump before, no torque beyond load and friction since | \
{MOST_HELD_RAD_S:g} rad/s that it should have changed by | none | end
TPDOs of each kind per SYNC | one | {100 * LOST_SHARE:g} % lost, weighted by exp(-age / {LOST_S:g} s); \
{MOST_SURPLUS} too many within {SURPLUS_CYCLES} cycles | none | flag, end
age of the feedback | one period | none | `feedback_timeout_s` | flag, end
heartbeat and NMT state | OPERATIONAL, in every heartbeat and no boot-up | none | once | end
heartbeat | one per `heartbeat_ms` | none | five periods, 0.5 s at least | end
EMCY | none, be it reset at once | none | once | end
frames that only the host sends | none from others | none | once | end
lateness of the host | none | half a period: flag | `feedback_timeout_s` | flag, end; blamed first
"""
"""Every rule, a line each: quantity, expected, within, for how long, and what then."""


def rules_table() -> str:
    """Write the rules as the table of docs/reliability.md."""
    head = "| quantity | expected | within | for how long | then |\n| --- | --- | --- | --- | --- |\n"
    return head + "".join(f"| {rule} |\n" for rule in RULES.splitlines())


def speed_tolerance_rad_s(one_rad_s: float, other_rad_s: float, counts_rad_s: float) -> float:
    """Give how far two readings of one shaft at one time may be from each other [rad/s]."""
    return SPEED_NOISE_RAD_S + counts_rad_s + SPEED_SHARE * max(abs(one_rad_s), abs(other_rad_s))


class PlcPart(NamedTuple):
    """What the PLC adds to both commands by itself: up to its amplitudes, either way."""

    m1_nm: float  # amplitude at m1
    m2_nm: float  # amplitude at m2
    is_on: bool  # whether its generator is confirmed on, and not just being switched


NO_PART: Final = PlcPart(0.0, 0.0, is_on=False)
"""Of a PLC whose generator is confirmed off."""


class CycleRecord(NamedTuple):
    """One cycle, as everything is judged by it."""

    t_ns: int  # monotonic
    m1: DriveRecord  # first drive
    m2: DriveRecord  # second drive
    plc: PlcPart = NO_PART  # its PRBS


@dataclass(frozen=True, slots=True)
class SupervisionLimits:
    """What the rules of one rig need: its guard's limits, a count of each speed [rad/s], and its vehicle."""

    guard: GuardLimits  # the rig file's
    count_m1_rad_s: float = 0.0  # one count of m1's speed [rad/s]
    count_m2_rad_s: float = 0.0  # one count of m2's speed [rad/s]
    vehicle: Vehicle | None = None  # None: speeds are not compared with what torques make


class _SharedPrbs:
    """Compares the PLC's PRBS at both drives: it adds one sequence to both references.

    Neither its level of a cycle nor its register is needed for that. A turn of both is no fault: everything is
    identified from the torques that the drives read.
    """

    def __init__(self, period_s: float) -> None:
        self._lags, self._cycles = math.ceil(PRBS_LAG_S / period_s), math.ceil(PRBS_S / period_s)
        # of each drive, the newest first: what the PLC made of its torque, over its part
        self._levels = [deque[float](maxlen=self._lags + 1) for _ in range(2)]
        # sums over the last cycles: weights, levels, their squares, and their products at each lag
        self._weight, self._sums, self._squares = 0.0, [0.0, 0.0], [0.0, 0.0]
        self._products = [0.0] * (2 * self._lags + 1)
        self._taken = 0

    def take(self, levels: tuple[float, float]) -> float:
        """Take a cycle's levels; give the correlation at the lag at which it is greatest, 1 where nothing tells."""
        left = 1.0 - 1.0 / self._cycles
        for drive, level in enumerate(levels):
            self._levels[drive].appendleft(level)
            self._sums[drive] = left * self._sums[drive] + level
            self._squares[drive] = left * self._squares[drive] + level**2
        one, other = self._levels
        pairs = [one[0] * level for level in other] + [level * other[0] for level in list(one)[1:]]
        self._products = [left * sum_ + pair for sum_, pair in zip_longest(self._products, pairs, fillvalue=0.0)]
        self._weight = left * self._weight + 1.0
        self._taken += 1
        means = [sum_ / self._weight for sum_ in self._sums]
        less, more = sorted(max(each / self._weight - m**2, 0.0) for each, m in zip(self._squares, means, strict=True))
        if self._taken < self._cycles or more < MOST_EVEN:
            return 1.0
        common = max(self._products) / self._weight - means[0] * means[1]
        return common / math.sqrt(less * more) if less > 1e-9 * more else 0.0


def _of_plc(plc: PlcPart) -> str:
    part_nm = plc.m1_nm + plc.m2_nm
    return f" and up to {part_nm:g} Nm of the PLC either way" if part_nm else ""


def _wrong_motion(motion: Motion, vehicle: Vehicle) -> str:
    """Say what of a motion no load and no allowed inertia explains; nothing where they do."""
    low, high = vehicle.gains[0] / GAIN_SHARE, vehicle.gains[1] * GAIN_SHARE
    gain, gain_std = motion.gain, DEVIATIONS * motion.gain_deviation
    load, load_std = motion.load_rad_s2, DEVIATIONS * motion.load_deviation_rad_s2
    speed = f"the speed 0x606C is {motion.speed_rad_s:.3g} rad/s"
    if abs(motion.held_rad_s) > MOST_HELD_RAD_S:
        return f"{speed} and stands, expected it to have changed by {motion.held_rad_s:.2g} rad/s at least"
    if motion.surprise > MOST_SURPRISE:
        off = 3.0 * motion.deviation_rad_s
        return (
            f"{speed}, expected {motion.predicted_rad_s:.3g} within {off:.2g} rad/s by torque, inertia and load: "
            "it, or the load, jumps with the torque"
        )
    if gain + gain_std < low or gain - gain_std > high:
        return (
            f"the speed changes {gain:.2g} times as fast as the torque makes {vehicle.inertia_kg_m2:g} kg m2 change, "
            f"expected {low:.2g} to {high:.2g} times, from full to empty; {speed}"
        )
    if abs(load) - load_std > vehicle.most_load_rad_s2:
        most_nm = vehicle.most_load_rad_s2 * vehicle.inertia_kg_m2
        return (
            f"the load is {load * vehicle.inertia_kg_m2:.0f} Nm at the shaft, expected at most {most_nm:.0f} Nm (a "
            f"grade of {100.0 * vehicle.most_grade:g} %); {speed}"
        )
    return ""


class Supervision:
    """Judges every cycle of one run."""

    def __init__(self, limits: SupervisionLimits, m1: InverterSettings, m2: InverterSettings) -> None:
        guard = limits.guard
        self._m1 = DriveSupervision(m1, guard, guard.error.m1_nm)
        self._m2 = DriveSupervision(m2, guard, guard.error.m2_nm)
        self._both = Excess(guard.error.sum_nm, guard.error.time_s, guard.period_s)
        self._counts_rad_s = limits.count_m1_rad_s + limits.count_m2_rad_s
        self._stale_ns = guard.feedback_timeout_s * NS_PER_S
        # in units of its tolerance, which grows with the speed
        self._apart = Excess(SPEED_NOISE_RAD_S, guard.error.time_s, guard.period_s)
        self._vehicle = limits.vehicle
        self._observer = None if limits.vehicle is None else VehicleObserver(limits.vehicle, guard.period_s)
        self._shared_prbs = _SharedPrbs(guard.period_s)
        self._cycles = 0
        self._first_ns: int | None = None
        self.ended: DriverError | None = None

    @property
    def ready(self) -> bool:
        """Whether both have answered and follow their target torques."""
        return all(each.feedback is not None and each.followed for each in (self._m1, self._m2))

    def take(self, record: CycleRecord) -> tuple[bool, bool]:
        """Judge one cycle; tell of each drive whether its readings are doubtful. What ends the run is in `ended`."""
        m1, m2, plc = self._m1, self._m2, record.plc
        m1.take(record.t_ns, record.m1, plc.m1_nm)
        m2.take(record.t_ns, record.m2, plc.m2_nm)
        self._cycles += 1
        one, other = m1.feedback, m2.feedback
        sum_fault = ""
        answered = record.m1.feedback is not None or record.m2.feedback is not None
        if answered and one is not None and other is not None:
            sum_fault = self._compare_sum(record, one, other)
            self._compare_speeds(record.t_ns, one, other)
            if plc.is_on:
                self._compare_prbs(plc)
            self._follow_vehicle(one, other)
            self._cycles = 0
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
            "with the rig file, see that its RPDO arrives, and what the PLC adds to it. For one that follows more "
            "slowly, or whose slope holds the torque offset 0x60B2 too, set [guard] torque_response_s."
        )

    def _compare_sum(self, record: CycleRecord, one: InverterFeedback, other: InverterFeedback) -> str:
        """Compare both together, by how far each reading is from its own prediction, whatever cycle it is of."""
        off_nm = abs(self._m1.off_nm + self._m2.off_nm)
        if off_nm <= self._both.tolerance:
            return ""
        self._m1.doubtful = self._m2.doubtful = True
        if not self._both.take(record.t_ns, off_nm, self._cycles):
            return ""
        return (
            f"both inverters: torque actual value 0x6077 is {one.torque_nm + other.torque_nm:g} Nm, expected "
            f"{record.m1.commanded_nm + record.m2.commanded_nm:g} Nm as commanded{_of_plc(record.plc)}, within "
            f"{self._both.tolerance:g} Nm "
            f"(torque_error_sum_nm): m1 {one.torque_nm:g} for {record.m1.commanded_nm:g} Nm, m2 {other.torque_nm:g} "
            f"for {record.m2.commanded_nm:g} Nm"
        )

    def _compare_speeds(self, t_ns: int, one: InverterFeedback, other: InverterFeedback) -> None:
        m1, m2 = self._m1, self._m2
        one_rad_s, other_rad_s = m1.speed.value, m2.speed.value
        difference = abs(one_rad_s - other_rad_s)
        if difference <= SPEED_NOISE_RAD_S:
            return
        tolerance = speed_tolerance_rad_s(one_rad_s, other_rad_s, self._counts_rad_s)
        if difference <= tolerance:
            return
        m1.doubtful = m2.doubtful = True
        if self._apart.take(t_ns, difference * SPEED_NOISE_RAD_S / tolerance, self._cycles):
            stopped = [(each, read) for each, read in ((m1, one), (m2, other)) if each.repeated]
            m1.faults += [
                each.stands_still(read, "the other drive reads a speed that changes") for each, read in stopped
            ]
            m1.faults.append(
                f"inverters m1 and m2: velocity actual value 0x606C, low-passed, is {one_rad_s:.3g} rad/s at m1 and "
                f"{other_rad_s:.3g} rad/s at m2, expected one speed within {tolerance:.2g} rad/s, for both read "
                "one shaft. Compare sign, unit (0x60A9) and gear of both, their resolvers, and their node ids."
            )

    def _compare_prbs(self, plc: PlcPart) -> None:
        m1, m2 = self._m1, self._m2
        if m1.plc_nm is None or m2.plc_nm is None:
            return
        # one that turned a smaller part would still be within its tolerance
        if 2.0 * plc.m1_nm <= m1.excess.tolerance or 2.0 * plc.m2_nm <= m2.excess.tolerance:
            return
        correlation = self._shared_prbs.take((m1.plc_nm / plc.m1_nm, m2.plc_nm / plc.m2_nm))
        if correlation < LEAST_CORRELATION:
            m1.faults.append(
                "inverters m1 and m2: their torques 0x6077 do not go up and down together with the PLC's own PRBS, got "
                f"a correlation of {correlation:.2f}, expected {LEAST_CORRELATION:g} at least within "
                f"{1000 * PRBS_LAG_S:g} ms. See that the PLC gives both its PRBS, and compare the signs of both."
            )

    def _follow_vehicle(self, one: InverterFeedback, other: InverterFeedback) -> None:
        if self._observer is None or self._vehicle is None:
            return
        speed_rad_s = 0.5 * (self._m1.speed.value + self._m2.speed.value)
        reading_rad_s = 0.5 * (one.speed_rad_s + other.speed_rad_s)
        motion = self._observer.take(one.torque_nm + other.torque_nm, speed_rad_s, reading_rad_s, self._cycles)
        if motion is not None and (wrong := _wrong_motion(motion, self._vehicle)):
            self._m1.faults.append(
                f"inverters m1 and m2: {wrong} at a torque of {one.torque_nm + other.torque_nm:.4g} Nm. Compare sign, "
                "unit (0x60A9) and gear of both speeds and the signs of both torques with the rig file, and its "
                "[vehicle]; look for a brake."
            )

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
        """Raise what has ended the run, if anything has."""
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
