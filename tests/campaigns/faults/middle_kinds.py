"""What the man in the middle does: frames that he changes, loses, repeats and invents, and rigs that he does it on."""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.inverter.cia402 import TorqueMode
from drivers.plc.types import PrbsSource
from hil.config.rig_file import Rig
from tests.rig.serving import changed

RPDO, TPDO, HEARTBEAT, EMCY = 0x200, 0x180, 0x700, 0x080
PATTERNS = ("once", "burst", "periodic", "for ever")
COMMAND = struct.Struct("<Hhh")
"""Controlword, target torque, torque offset."""

ANSWER = struct.Struct("<Hhi")
"""Statusword, torque and velocity actual value."""


@dataclass
class Fault:
    """What happens, from a moment on, in the cycles of its pattern."""

    kind: str
    drive: int
    at: int
    pattern: str
    on: int
    period: int
    size: float
    frozen: dict[int, bytes] = field(default_factory=dict)

    def acts(self, cycle: int) -> bool:
        since = cycle - self.at
        if since < 0 or self.pattern == "for ever":
            return since >= 0
        length = {"once": 1, "burst": self.on}.get(self.pattern)
        return since < length if length is not None else since % self.period < self.on

    def __str__(self) -> str:
        pattern = {"periodic": f"{self.on} of {self.period}", "burst": f"burst of {self.on}"}
        return f"m{self.drive} from cycle {self.at}, {pattern.get(self.pattern, self.pattern)}, size {self.size:.2f}"


Change = Callable[[Fault, bytes], list[bytes]]


def command(
    fault: Fault,
    data: bytes,
    word: int | None = None,
    factor: float = 1.0,
    offset: int = 0,
    prbs_factor: float | None = None,
) -> list[bytes]:
    controlword, target, prbs = COMMAND.unpack(data[:6])
    sent = (round(factor * target) + offset, round((factor if prbs_factor is None else prbs_factor) * prbs))
    clipped = [max(-1000, min(1000, each)) for each in sent]
    return [COMMAND.pack(controlword if word is None else word, *clipped) + data[6:]]


def stuck(fault: Fault, data: bytes) -> list[bytes]:
    """A torque of its own, whatever is asked for."""
    return [COMMAND.pack(0x000F, round(1200 * fault.size - 600), 0) + data[6:]]


def answer(data: bytes, set_bits: int = 0, clear_bits: int = 0, speed: Callable[[int], float] | None = None) -> bytes:
    status, torque, velocity = ANSWER.unpack(data[:8])
    status = (status | set_bits) & ~clear_bits
    return ANSWER.pack(status, torque, velocity if speed is None else round(speed(velocity)))


def counts(data: bytes, torque: int) -> list[bytes]:
    """Bit 11, and so many counts of torque."""
    status, _, velocity = ANSWER.unpack(data[:8])
    return [ANSWER.pack(status | 1 << 11, torque, velocity)]


def in_turn(fault: Fault, drive: int, cycle: int, data: bytes) -> list[bytes]:
    """m1 answers at odd, m2 at even SYNCs, and one of them reads another speed."""
    if cycle % 2 != drive % 2:
        return []
    factor = (0.5, 0.0, -1.0)[int(3.0 * fault.size)]
    return [answer(data, speed=lambda v: factor * v) if drive == fault.drive else data]


def lost(fault: Fault, cycle: int, data: bytes) -> list[bytes]:
    """Nine answers of twenty never come."""
    return [] if cycle * 7 % 20 < 9 else [data]


def kept(fault: Fault, cob_id: int, data: bytes) -> list[bytes]:
    return [fault.frozen.setdefault(cob_id, data)]


LEAVES = (0x0006, 0x0007, 0x0002)
"""Shutdown, disable operation, quick stop."""

TO_DRIVE: dict[str, Change] = {
    "leaves operation": lambda f, d: command(f, d, word=LEAVES[int(f.size * 100) % 3]),
    "torque times": lambda f, d: command(f, d, factor=4.0 * f.size - 2.0),
    "torque plus": lambda f, d: command(f, d, offset=round(800 * f.size - 400)),
    "torque nothing": lambda f, d: command(f, d, factor=0.0),
    "limit bit, no torque": lambda f, d: command(f, d, factor=0.0),
    "ignores its target": lambda f, d: command(f, d, factor=0.0),
    "RPDO lost": lambda f, d: [],
    "stuck and frozen": lambda f, d: kept(f, RPDO, d),
    "stuck at another torque, frozen": stuck,
    "limit bit, some counts": lambda f, d: command(f, d, factor=0.0),
    "PRBS ignored, 9 of 20 answers lost": lambda f, d: command(f, d, prbs_factor=0.0),
    "PRBS reversed, 9 of 20 answers lost": lambda f, d: command(f, d, prbs_factor=-1.0),
    "slow slope: PRBS ignored": lambda f, d: command(f, d, prbs_factor=0.0),
    "slow slope: stuck": stuck,
    "PLC's PRBS idle: torque plus": lambda f, d: command(f, d, offset=round(400 * f.size - 200)),
}
TO_HOST: dict[str, Change] = {
    "speed reversed": lambda f, d: [answer(d, speed=lambda v: -v)],
    "speed stuck": lambda f, d: [answer(d, speed=lambda v: ANSWER.unpack(kept(f, TPDO, d)[0][:8])[2])],
    "speed zero": lambda f, d: [answer(d, speed=lambda v: 0)],
    "speed times": lambda f, d: [answer(d, speed=lambda v: 2.0 * f.size * v)],
    "foreign TPDO": lambda f, d: [d, answer(d, speed=lambda v: 0)],
    "TPDO doubled": lambda f, d: [d, d],
    "TPDO lost": lambda f, d: [],
    "limit bit, no torque": lambda f, d: [answer(d, set_bits=1 << 11)],
    "ignores its target": lambda f, d: [answer(d, clear_bits=1 << 12)],
    "stuck and frozen": lambda f, d: kept(f, TPDO, d),
    "limit bit, some counts": lambda f, d: counts(d, (3, 5, -45)[int(3.0 * f.size)]),
}
TO_HOST_OF_BOTH: dict[str, Callable[[Fault, int, int, bytes], list[bytes]]] = {
    "answers in turn, a wrong speed": in_turn,
    "both speeds reversed": lambda f, n, k, d: [answer(d, speed=lambda v: -v)],
    "both speeds zero": lambda f, n, k, d: [answer(d, speed=lambda v: 0)],
    "both speeds stuck": lambda f, n, k, d: [answer(d, speed=lambda v: ANSWER.unpack(kept(f, TPDO + n, d)[0][:8])[2])],
    "both speeds half": lambda f, n, k, d: [answer(d, speed=lambda v: v / 2)],
    "PRBS ignored, 9 of 20 answers lost": lambda f, n, k, d: lost(f, k, d) if n == f.drive else [d],
    "PRBS reversed, 9 of 20 answers lost": lambda f, n, k, d: lost(f, k, d) if n == f.drive else [d],
    "stuck at another torque, frozen": lambda f, n, k, d: kept(f, TPDO, d) if n == f.drive and k > f.at else [d],
}
"""By fault, drive, cycle and data."""

WITH_SYNC: dict[str, tuple[tuple[int, bytes], ...]] = {
    "PRE-OPERATIONAL heartbeat": ((HEARTBEAT, b"\x7f"),),
    "boot-up": ((HEARTBEAT, b"\x00"),),
    "EMCY reset at once": ((EMCY, bytes.fromhex("1023010000000000")), (EMCY, bytes(8))),
}
"""Frames that come to the host next to those of the drive."""

ADDED: dict[str, float] = {"PLC's PRBS ignored": 0.0, "PLC's PRBS turned": -1.0}
"""What one drive makes of what the PLC adds, times it."""

OTHERS = ("node ids exchanged", "second host", "two hosts at once", "clock stepped", "PLC registers exchanged")
KINDS = (*dict.fromkeys((*TO_DRIVE, *TO_HOST, *TO_HOST_OF_BOTH, *WITH_SYNC, *ADDED, *OTHERS)),)
LASTING = (*TO_HOST_OF_BOTH, *ADDED, *(kind for kind in TO_DRIVE if "slope" in kind or "PLC's" in kind))
"""Kinds that stay once they have come: what of them is short is another kind."""


def rig_of(kind: str, rig: Rig) -> Rig:
    """The rig that a kind is tried on: the PLC's generator or slow slopes, where the kind is about them."""
    if kind.startswith("PLC's"):
        with_plc: Rig = changed(rig, {"prbs": {"source": PrbsSource.PLC}})
        return with_plc
    if kind.startswith("slow slope"):
        slow = {"mode": TorqueMode.PROFILE_TORQUE, "torque_slope_nm_per_s": 700.0}
        sloped: Rig = changed(rig, {"inverters.m1": slow, "inverters.m2": slow})
        return sloped
    return rig
