"""The torque a drive reports against the one it was commanded: too much, too little, none, or the other way round.

::

    allowed    [min - error, max + error]   of the commands in effect within the last ``response_s``
    fault      outside for ``time_s`` in all within the last ``WINDOW * time_s``

The range is that of opendbc's ``dist_to_meas_check`` and ``max_limit_check``: a drive is between where it was and where
it is sent. A drive may sample its torque after or before it takes the command of the same SYNC, always the same way:
both are tried, and it is a fault where one fails for ``time_s`` and the other for half of it.

Outside is added up, not counted in a row: a PRBS crosses the range again and again, and a drive that turns it round is
outside only where a level is held for longer than ``response_s``. A reading that repeats the one before says nothing
while the command changes: it is an old one. A drive that says that a limit of its own holds it back (statusword bit
11), or that it does not follow its target (bit 12, which `drivers.inverter.follow_watch` judges), may give less, down
to nothing.

No clock, bus or thread here: time comes in as nanoseconds.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from drivers.errors import WrongTorque
from drivers.guard_limits import NS_PER_S, ErrorLimits

WINDOW: Final = 2.5
"""Outside for two parts in five of the time is a fault."""

SAMPLED: Final = (0, 1)
"""Cycles between a command and the first reading it can show in: sampled after it is taken, or before."""

_NAMES: Final = (
    ("inverter m1", "torque_error_nm"),
    ("inverter m2", "torque_error_nm"),
    ("both inverters", "torque_error_sum_nm"),
)


@dataclass(frozen=True, slots=True)
class Measured:
    """Torque actual value 0x6077 of one inverter in one cycle [Nm].

    ``limited`` says that the drive admits to giving less than it is asked for, ``repeated`` that torque and speed are
    those of the reading before, to the last bit.
    """

    torque_nm: float
    limited: bool = False
    repeated: bool = False


class _Outside:
    """The samples of one torque that were outside its range, within the window."""

    __slots__ = ("_times_ns", "_window_ns")

    def __init__(self, window_ns: int) -> None:
        self._window_ns = window_ns
        self._times_ns: deque[int] = deque()

    def take(self, t_ns: int, outside: bool) -> int:
        """Take one sample; give how many have been outside."""
        while self._times_ns and t_ns - self._times_ns[0] >= self._window_ns:
            self._times_ns.popleft()
        if outside:
            self._times_ns.append(t_ns)
        return len(self._times_ns)


class TorqueError:
    """Compares what was commanded with what came, cycle by cycle.

    Parameters
    ----------
    limits
        How far, how long, and how fast a drive follows.
    period_s
        Time that one sample stands for [s].
    """

    __slots__ = ("_commands", "_limits", "_most", "_outside", "_width")

    def __init__(self, limits: ErrorLimits, period_s: float) -> None:
        self._limits = limits
        self._width = max(1, round(limits.response_s / period_s)) + 1
        self._commands: deque[tuple[float, float, float]] = deque(maxlen=self._width + max(SAMPLED))
        self._most = max(1.0, limits.time_s / period_s)
        window_ns = round(WINDOW * limits.time_s * NS_PER_S)
        self._outside = {(part, lag): _Outside(window_ns) for part in range(3) for lag in SAMPLED}

    def commanded(self, m1_nm: float, m2_nm: float) -> None:
        """Take what the inverters are commanded in this cycle [Nm]."""
        self._commands.append((m1_nm, m2_nm, m1_nm + m2_nm))

    def compare(self, t_ns: int, m1: Measured | None, m2: Measured | None) -> None:
        """Take what came in the cycle of the last command; None where nothing came, which is for others to judge.

        Raises
        ------
        WrongTorque
            If a torque, or the sum of both, has been outside its range for too long; names all that have.
        """
        faults = tuple(self._faults(t_ns, m1, m2))
        if faults:
            raise WrongTorque(
                f"{'; '.join(faults)}. The drive does not give what it is asked for: compare its rated torque, scale, "
                "sign and limits with the rig file, and see that its RPDO arrives. For one that follows more slowly "
                "set [guard] torque_response_s."
            )

    def _faults(self, t_ns: int, m1: Measured | None, m2: Measured | None) -> Iterator[str]:
        if not self._commands:
            return
        if m1 is not None:
            yield from self._fault(t_ns, 0, m1, self._limits.m1_nm)
        if m2 is not None:
            yield from self._fault(t_ns, 1, m2, self._limits.m2_nm)
        if m1 is not None and m2 is not None and not (m1.limited or m2.limited):
            both = Measured(m1.torque_nm + m2.torque_nm, repeated=m1.repeated or m2.repeated)
            for fault in self._fault(t_ns, 2, both, self._limits.sum_nm):
                asked_m1_nm, asked_m2_nm, _ = self._commands[-1]
                each = f"m1 {m1.torque_nm:g} for {asked_m1_nm:g} Nm, m2 {m2.torque_nm:g} for {asked_m2_nm:g} Nm"
                yield f"{fault}: {each}"

    def _fault(self, t_ns: int, part: int, got: Measured, error_nm: float) -> Iterator[str]:
        counts = [self._count(t_ns, part, lag, got, error_nm) for lag in SAMPLED]
        if max(counts) >= self._most and min(counts) >= self._most / 2.0:
            where, key = _NAMES[part]
            low, high = self._range(part, SAMPLED[0], got.limited)
            yield (
                f"{where}: torque actual value 0x6077 is {got.torque_nm:g} Nm, expected {_shown(low, high)} as "
                f"commanded, within {error_nm:g} Nm ({key})"
            )

    def _count(self, t_ns: int, part: int, lag: int, got: Measured, error_nm: float) -> int:
        low, high = self._range(part, lag, got.limited)
        outside = not low - error_nm <= got.torque_nm <= high + error_nm
        return self._outside[part, lag].take(t_ns, outside and not (got.repeated and self._moves(part)))

    def _moves(self, part: int) -> bool:
        return any(torques_nm[part] != self._commands[-1][part] for torques_nm in self._commands)

    def _range(self, part: int, lag: int, limited: bool) -> tuple[float, float]:
        """Give least and greatest of the commands that may be in effect."""
        last = max(1, len(self._commands) - lag)
        torques_nm = [self._commands[k][part] for k in range(max(0, last - self._width), last)]
        if limited:
            torques_nm.append(0.0)
        return min(torques_nm), max(torques_nm)


def _shown(low_nm: float, high_nm: float) -> str:
    return f"{low_nm:g} Nm" if low_nm == high_nm else f"{low_nm:g} to {high_nm:g} Nm"
