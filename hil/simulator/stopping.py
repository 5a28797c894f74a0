"""How a simulated drive stops by itself: its option codes, and how it notices that its host is gone."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Final

from drivers.canopen.heartbeat import HEARTBEAT_COB_ID
from drivers.canopen.silence import Silence
from drivers.inverter.cia402 import AUTOMATIC, PowerState

_S = PowerState

STANDARD_CODES: Final[Mapping[int, int]] = MappingProxyType(
    {0x6007: 1, 0x605A: 2, 0x605B: 0, 0x605C: 1, 0x605D: 1, 0x605E: 2}
)
"""CiA 402-2's own default values, for a drive whose EDS lists no such object."""

_STAYING: Final = 4
"""Quick stop codes from 5 on are those from 1 on, but the drive stays in QUICK STOP ACTIVE."""

NS_PER_MS = 1_000_000

GRACE_NS = 40 * NS_PER_MS
"""What this program, which is no drive, leaves for reading heartbeats that came while it was held up itself [ns]."""

LONGEST_LOOK_NS = 15 * NS_PER_MS
"""It looks every 10 ms: a longer time between two looks is one in which it was held up."""

HEARTBEAT_ERROR: Final = 0x8130  # error code of CiA 301


class Ramp(Enum):
    """How the torque goes to zero."""

    AT_ONCE = "at once"
    SLOPE = "by the torque slope 0x6087"
    QUICK = "by the drive's own quick slope"


class AbortConnection(IntEnum):
    """Abort connection option code, 0x6007."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop under way: the ramp, the power state while it lasts, and that at its end."""

    ramp: Ramp  # how the torque goes to zero
    passing: PowerState  # until the torque is zero
    final: PowerState  # once the torque is zero


_SLOPES: Final = MappingProxyType({1: Ramp.SLOPE, 2: Ramp.QUICK})

KNOWN_CODES: Final[Mapping[int, frozenset[int]]] = MappingProxyType(
    {
        0x6007: frozenset(AbortConnection),
        0x605A: frozenset(range(9)),
        0x605B: frozenset({0, 1}),
        0x605C: frozenset({0, 1}),
        0x605D: frozenset(range(1, 5)),
        0x605E: frozenset(range(5)),
    }
)
"""The codes this drive knows of each object; it refuses others."""


def stop_between(state: PowerState, target: PowerState, codes: Mapping[int, int]) -> Stop:
    """Choose how a drive goes from a state to another."""
    if state is _S.OPERATION_ENABLED:
        if target is _S.READY_TO_SWITCH_ON:
            return Stop(_ramp(codes[0x605B]), state, target)
        if target is _S.SWITCHED_ON:
            return Stop(_ramp(codes[0x605C]), state, target)
        if target is _S.QUICK_STOP_ACTIVE:
            return _quick_stop(codes[0x605A])
    if target is _S.FAULT_REACTION_ACTIVE:
        return Stop(_ramp(codes[0x605E]), target, AUTOMATIC[target])
    return Stop(Ramp.AT_ONCE, target, target)


def halt_ramp(codes: Mapping[int, int]) -> Ramp:
    """Choose how the torque goes to zero while halt, bit 8 of the controlword, is set."""
    return _ramp(codes[0x605D])


def _quick_stop(code: int) -> Stop:
    if code == 0:
        return Stop(Ramp.AT_ONCE, _S.SWITCH_ON_DISABLED, _S.SWITCH_ON_DISABLED)
    stays = code > _STAYING
    ramp = _ramp(code - _STAYING if stays else code)
    return Stop(ramp, _S.QUICK_STOP_ACTIVE, _S.QUICK_STOP_ACTIVE if stays else _S.SWITCH_ON_DISABLED)


def _ramp(code: int) -> Ramp:
    return _SLOPES.get(code, Ramp.AT_ONCE)


class HeartbeatConsumer:
    """Watches one heartbeat from the first: node id in bits 16 to 22, time in bits 0 to 15 [ms], 0 is off."""

    def __init__(self, value: int = 0) -> None:
        self.cob_id = HEARTBEAT_COB_ID + (value >> 16 & 0x7F)
        timeout_ms = value & 0xFFFF
        self._watches = timeout_ms > 0
        self._silence = Silence(timeout_ms * NS_PER_MS, GRACE_NS, LONGEST_LOOK_NS)

    def beat(self, t_ns: int) -> None:
        """Take a heartbeat, at this time of the monotonic clock [ns]."""
        self._silence.beat(t_ns)

    def lost(self, now_ns: int) -> bool:
        """Whether the heartbeat has ended; once, then watching starts anew with the next one."""
        if not self._watches or not self._silence.has_ended(now_ns):
            return False
        self._silence.end()
        return True


class RpdoDeadline:
    """Watches one RPDO, from the first that comes."""

    def __init__(self, deadline_ms: int) -> None:
        self._deadline_ns = deadline_ms * NS_PER_MS
        self._last_ns: int | None = None

    def received(self, now_ns: int) -> None:
        """Take an RPDO, at this time [ns]."""
        self._last_ns = now_ns

    def missed(self, now_ns: int) -> bool:
        """Whether the deadline is past; once, then watching starts anew with the next RPDO."""
        if self._deadline_ns == 0 or self._last_ns is None or now_ns - self._last_ns <= self._deadline_ns:
            return False
        self._last_ns = None
        return True


class HostWatch:
    """The watch of one node."""

    def __init__(self, real_time: bool) -> None:
        self._real_time = real_time
        self._sync_ns = self._next_sync_ns = 0
        self._deadlines: dict[int, RpdoDeadline] = {}
        self.heartbeat = HeartbeatConsumer()

    def clear(self) -> None:
        """Watch nobody, as at power-on."""
        self.heartbeat = HeartbeatConsumer()
        self._deadlines.clear()

    def watch_rpdos(self, deadlines_ms: Mapping[int, int]) -> None:
        """Watch these RPDOs from the first of each on, by COB-ID [ms]; 0 is not at all."""
        self._deadlines = {cob_id: RpdoDeadline(deadline_ms) for cob_id, deadline_ms in deadlines_ms.items()}

    def take_sync(self, period_s: float) -> None:
        """Let simulated time advance to this SYNC; the next one comes after ``period_s`` [s]."""
        self._sync_ns = self._next_sync_ns
        self._next_sync_ns += round(period_s * 1e9)

    def received(self, cob_id: int, wall_ns: int) -> None:
        """Take an RPDO, at this time of the wall clock [ns]."""
        self._deadlines[cob_id].received(wall_ns if self._real_time else self._next_sync_ns)

    def rpdo_missed(self, wall_ns: int) -> bool:
        """Whether an RPDO is overdue; reported once for each."""
        now_ns = wall_ns if self._real_time else self._sync_ns
        missed = [deadline.missed(now_ns) for deadline in self._deadlines.values()]  # every one is asked
        return any(missed)


class Ticker:
    """Calls until stopped."""

    def __init__(self, period_s: float, call: Callable[[], None], name: str) -> None:
        self._period_s = period_s
        self._call = call
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread; nothing is called after this returns."""
        self._stopping.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopping.wait(self._period_s):
            self._call()
