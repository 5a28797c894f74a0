"""What one drive is judged by in each cycle: state, messages, and its torque against the prediction.

A rule with a size has a tolerance and a time: while a reading is outside its tolerance, its distance from what is
predicted is summed over the time since the reading before, and the run ends where the sum reaches tolerance times time:
31 Nm with a tolerance of 30 Nm for 0.12 s, 300 Nm within two cycles, and a burst that comes again and again as soon as
they add up to as much. What has been summed is forgotten evenly over `FORGOTTEN_S` of readings within their tolerance.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final, NamedTuple

from drivers.guard_limits import NS_PER_S, GuardLimits
from drivers.inverter.cia402 import FAULT_STATES, Command, PowerState, TorqueMode
from drivers.inverter.feedback import InverterFeedback
from drivers.inverter.observer import LowPass, TorquePrediction
from drivers.inverter.settings import InverterSettings

FORGOTTEN_S: Final = 10.0  # what has been summed up to its limit is forgotten in this time [s]

NO_TORQUE_S: Final = 1.0
"""So long a drive may be held at no torque by a limit of its own, at an error of the tolerance [s]."""

MOST_SURPLUS: Final = 3
"""So many TPDOs more than SYNCs end a run: a controller may hear one frame twice (ISO 11898, last bit of EOF)."""

SURPLUS_CYCLES: Final = 100  # after so many cycles one that was too many is forgotten

LOST_S: Final = 10.0
LOST_SHARE: Final = 0.2
"""Of the TPDOs of the last `LOST_S`, weighted by exp(-age / `LOST_S`), so many may be lost."""


def left_operation(where: str, state: PowerState) -> str:
    """Say that a drive is not in the state it was armed in."""
    return (
        f"{where}: power state is {state.value} after controlword 0x{Command.ENABLE_OPERATION.value:04X} (enable "
        "operation), expected operation enabled. The drive left it by itself, without a fault: look at its enable "
        "inputs, limit switches and safe torque off. It is not enabled again in this run."
    )


def most_late(guard: GuardLimits) -> int:
    """Give how many answers may still come: an older one is too old for another rule."""
    return round(guard.feedback_timeout_s / guard.period_s)


class DriveRecord(NamedTuple):
    """One drive in one cycle: its command, its answer (None without), TPDOs of its seldomest and commonest kind."""

    commanded_nm: float  # [Nm], base and PRBS
    feedback: InverterFeedback | None  # of this cycle's SYNC
    fewest: int = 1  # TPDOs of the seldomest kind
    most: int = 1  # TPDOs of the commonest kind
    offset_nm: float = 0.0  # of the command, what no slope of the drive holds


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

    def take(self, t_ns: int, distance: float, cycles: int = 1) -> bool:
        """Take a distance beyond the tolerance, for so many cycles; tell whether that is too much."""
        within_ns = max(0, t_ns - self._at_ns - cycles * self._period_ns)
        self._sum = max(0.0, self._sum - within_ns * self._forgets) + distance * cycles * self._period_ns
        self._at_ns = t_ns
        return self._sum >= self._limit

    def clear(self) -> None:
        """Forget what was summed."""
        self._sum = 0.0


class DriveSupervision:
    """The rules that one drive is judged by."""

    def __init__(self, settings: InverterSettings, guard: GuardLimits, tolerance_nm: float) -> None:
        self.where = settings.where
        self.name = settings.name
        self._mode = settings.mode.title
        self._state_timeout_s = settings.state_timeout_s
        self._watches_follow = settings.mode is TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE and settings.follow_bit
        self._guard = guard
        slope = settings.torque_slope_nm_per_s if settings.mode is TorqueMode.PROFILE_TORQUE else None
        self._most_late = most_late(guard)
        self.torque = TorquePrediction(guard.period_s, guard.error.response_s, slope, self._most_late)
        self.excess = Excess(tolerance_nm, guard.error.time_s, guard.period_s)
        self._stale = Excess(tolerance_nm, guard.feedback_timeout_s, guard.period_s)
        self._held = Excess(tolerance_nm, NO_TORQUE_S, guard.period_s)
        self._lost_left = math.exp(-guard.period_s / LOST_S)
        self.lost_share = 0.0
        self.feedback: InverterFeedback | None = None
        self.answered_ns: int | None = None
        self.repeated = 0
        self.doubtful = False
        self.faults: list[str] = []
        self.wrong_torque = ""
        self.off_nm = 0.0
        self.plc_nm: float | None = None
        self.speed = LowPass(guard.period_s)
        self.followed = not self._watches_follow
        self._ignored_ns: int | None = None
        self._asked = False
        self._fresh_nm = 0.0
        self._surplus = self._cycles = 0
        self._unanswered = 0
        self._late_ns: deque[int] = deque(maxlen=self._most_late)

    def take(self, t_ns: int, seen: DriveRecord, part_nm: float) -> None:
        """Judge one cycle of this drive alone, to which the PLC adds up to its part, either way [Nm].

        ``off_nm`` is then how far its torque is outside of what is predicted, and ``plc_nm`` what the PLC made of it:
        None without an answer, and where a slope or a lost message leaves room for more than that part.
        """
        self.doubtful, self.plc_nm = False, None
        if seen.fewest != 1 or seen.most != 1 or self._surplus or self._late_ns or self.lost_share:
            self._count(t_ns, seen)
        self.torque.command(seen.commanded_nm - seen.offset_nm, seen.offset_nm)
        self._unanswered += 1
        feedback = seen.feedback
        if feedback is None:
            return
        cycles, self._unanswered = self._unanswered, 0
        if feedback.state is not PowerState.OPERATION_ENABLED:
            self._left(feedback.state)
        if self._watches_follow and not (feedback.follows and self.followed):
            self._follow(t_ns, feedback.follows, seen.commanded_nm)
        before, self.feedback, self.answered_ns = self.feedback, feedback, t_ns
        if before is not None and feedback.torque_raw == before.torque_raw and feedback.speed_raw == before.speed_raw:
            self.repeated += cycles
            self._repeats(t_ns, feedback, seen.commanded_nm, cycles)
        else:
            self._fresh_nm, self.repeated = seen.commanded_nm, 0
            self._stale.clear()
        self.speed.take(feedback.speed_rad_s, cycles)
        late = min(max(cycles - 1, seen.most - 1) + self.repeated, self._most_late)
        self._compare(t_ns, feedback, part_nm, late, cycles)
        if feedback.limited:
            self._limited(t_ns, feedback.torque_nm, seen.commanded_nm, cycles)

    def _compare(self, t_ns: int, feedback: InverterFeedback, part_nm: float, late: int, cycles: int) -> None:
        """Compare a torque with what is predicted: a lag or a slope of the drive keeps it within the PLC's levels."""
        torque_nm, tolerance_nm = feedback.torque_nm, self.excess.tolerance
        low, high = self.torque.range(late)
        if part_nm and high - low < part_nm:
            self.plc_nm = torque_nm - 0.5 * (low + high)
        if feedback.limited:
            low, high = min(low, 0.0), max(high, 0.0)
        low, high = low - part_nm, high + part_nm
        if low <= torque_nm <= high:  # as in nearly every cycle
            self.off_nm = 0.0
            return
        self.off_nm = off_nm = torque_nm - min(max(torque_nm, low), high)
        if abs(off_nm) > tolerance_nm:
            self.doubtful = True
            if self.excess.take(t_ns, abs(off_nm), cycles):
                self._wrong(feedback, low, high, part_nm)

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
        missing = max(0, 1 - seen.fewest) - came
        self.lost_share = max(0.0, self._lost_left * self.lost_share + (1.0 - self._lost_left) * missing)
        self.lost_share = 0.0 if self.lost_share < 1e-4 else self.lost_share
        if self._surplus >= MOST_SURPLUS or self.lost_share > LOST_SHARE:
            percent = f"{100 * self.lost_share:.0f} %"
            lost = (
                f"{percent} of its TPDOs are lost, each weighted by exp(-age / {LOST_S:g} s), expected at most "
                f"{100 * LOST_SHARE:g} %"
            )
            surplus = f"{self._surplus} TPDOs more than SYNCs in the last {self._cycles} cycles, expected one per SYNC"
            self.faults.append(
                f"{self.where}: {surplus if self._surplus >= MOST_SURPLUS else lost}. Look for another producer of "
                "SYNC or of this TPDO, its transmission type, and a bus without room; a simulated one answers late on "
                "a busy machine."
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

    def _repeats(self, t_ns: int, feedback: InverterFeedback, commanded_nm: float, cycles: int) -> None:
        moved_nm = abs(commanded_nm - self._fresh_nm)
        if moved_nm > self._stale.tolerance and self._stale.take(t_ns, moved_nm, cycles):
            self.faults.append(self.stands_still(feedback, f"the command moved by up to {moved_nm:g} Nm"))

    def stands_still(self, feedback: InverterFeedback, while_: str) -> str:
        """Say that feedback does not change any more."""
        return (
            f"{self.where}: feedback stands still at torque 0x6077 = {feedback.torque_raw} and speed 0x606C = "
            f"{feedback.speed_raw} counts while {while_}, expected readings that follow. The drive sends old values: "
            "check its program, and power-cycle it."
        )

    def _wrong(self, feedback: InverterFeedback, low: float, high: float, part_nm: float) -> None:
        if self._watches_follow and not feedback.follows:
            self.faults.append(self._ignores())
            return
        plc = f" and up to {part_nm:g} Nm of the PLC either way" if part_nm else ""
        expected = f"{low:g} Nm" if low == high else f"{low:g} to {high:g} Nm"
        self.wrong_torque = (
            f"inverter {self.name}: torque actual value 0x6077 is {feedback.torque_nm:g} Nm, expected {expected} as "
            f"commanded{plc}, within {self.excess.tolerance:g} Nm (torque_error_nm)"
        )

    def _limited(self, t_ns: int, torque_nm: float, commanded_nm: float, cycles: int) -> None:
        missing_nm, tolerance_nm = abs(commanded_nm) - abs(torque_nm), self._held.tolerance
        if abs(torque_nm) <= tolerance_nm < missing_nm and self._held.take(t_ns, missing_nm, cycles):
            self.faults.append(
                f"{self.where}: statusword 0x6041 bit 11 (internal limit) is set and the torque 0x6077 is "
                f"{torque_nm:g} Nm, expected some of the {commanded_nm:g} Nm commanded. A limit of the drive holds "
                "all of it back: look at its temperature, DC link and limits."
            )
