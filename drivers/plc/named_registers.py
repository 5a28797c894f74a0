"""The registers of a map by their names: read as values that can be, written and read back; and the host's watchdog.

A value that no vehicle has is one that was misread. The usual cause is the order of the two words of a 32-bit value,
which Modbus leaves to the maker: 350 Nm read in the other order is 2.4e-41 Nm, or a billion. Neither would hold a
torque back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from drivers.errors import DeviceFault, DeviceTimeout, ProtocolViolation
from drivers.plc.modbus_link import ModbusLink
from drivers.plc.register import Register, Value, WordOrder
from drivers.plc.register_map import USED, Block, RegisterMap, blocks_of, from_si, to_si

PLAUSIBLE: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    {
        "speed_limit": (0.1, 1e4),
        "torque_limit": (0.1, 1e5),
        "prbs_torque": (-1e5, 1e5),
        "prbs_amplitude": (0.01, 1e5),
        "prbs_divider": (1, 1e6),
        "prbs_seed": (1, 1023),
        "host_count_seen": (0, 65535),
    }
)
"""Least and greatest value a vehicle may have, in the unit the driver works in; 0 may be everywhere: nothing is set."""

LEAST_TORQUE_NM: Final = 1e-6  # a torque below this and not zero is no torque but a misread number [Nm]

COUNTS: Final = 65536  # the count starts over here, so that it fits 16 bits

NS_PER_S: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Reading:
    """One register as it was read."""

    name: str  # in the register map
    register: Register  # its kind, address, type and scale
    value: Value | None  # what it holds, in the register's own unit
    problem: str | None = None  # why the value can't be believed
    expected: str = ""  # what it should be, where there is a problem

    @property
    def shown(self) -> str:
        """The value in words, without its unit."""
        if self.value is None:
            return "–"
        return f"{self.value:.7g}" if isinstance(self.value, float) else str(self.value).lower()

    @property
    def unit(self) -> str:
        """The register's unit; empty for counts, states and bits."""
        return "" if self.register.unit == "1" else self.register.unit

    def required(self) -> Value:
        """Give the value in the unit the driver works in."""
        if self.problem is not None or self.value is None:
            raise ProtocolViolation(
                f"register {self.name} ({self.register.kind.value} {self.register.address}): expected {self.expected}, "
                f"got {self.problem}"
            )
        return to_si(self.name, self.register, self.value)


def reading(name: str, register: Register, words: Sequence[int]) -> Reading:
    """Make a value of words, and judge it."""
    try:
        value = register.decode(words)
    except ProtocolViolation as error:
        return Reading(name, register, None, str(error), "a value of its type")
    if is_plausible(name, register, value):
        return Reading(name, register, value)
    unit = f" {register.unit}" if register.unit != "1" else ""
    problem = f"{value:.7g}{unit}. {_advice(name, register, words)}"
    return Reading(name, register, value, problem, _range(name))


def is_plausible(name: str, register: Register, value: Value) -> bool:
    """Whether a vehicle may have such a value; what nothing is known of may be anything."""
    if name not in PLAUSIBLE or isinstance(value, str):
        return True
    low, high = PLAUSIBLE[name]
    number = float(to_si(name, register, value))
    return number == 0.0 or (low <= number <= high and abs(number) > LEAST_TORQUE_NM)


def _range(name: str) -> str:
    low, high = PLAUSIBLE[name]
    unit = USED[name][1]
    return f"0, or {low:g} to {high:g}{'' if unit == '1' else f' {unit}'}"


def _advice(name: str, register: Register, words: Sequence[int]) -> str:
    """Say what the value would be with the words in the other order, where that makes one."""
    if register.word_order is not None:
        order = next(each for each in WordOrder if each is not register.word_order)
        other = register.model_copy(update={"word_order": order})
        try:
            value = other.decode(words)
        except ProtocolViolation:
            value = None
        if value is not None and not isinstance(value, str) and is_plausible(name, other, value):
            return f"With word_order = {order.value!r} in the register map it would be {value:.7g} {register.unit}."
    return "Compare address, type, scale and word order in the register map with the PLC's program."


class NamedRegisters:
    """Registers of one PLC; one request for each run of adjacent ones."""

    def __init__(self, link: ModbusLink, register_map: RegisterMap) -> None:
        self._link = link
        self._map = register_map

    async def all(self) -> tuple[Reading, ...]:
        """Read every register of the map, in the order of the map; what can't be believed says so and is kept."""
        readings: dict[str, Reading] = {}
        for block in blocks_of(self._map, self._map.registers):
            try:
                readings |= await self._read_block(block)
            except (ProtocolViolation, DeviceFault) as error:
                readings |= {
                    name: Reading(name, self._map[name], None, str(error), "a register that can be read")
                    for name in block.names
                }
        return tuple(readings[name] for name in self._map.registers)

    async def read(self, names: Iterable[str]) -> dict[str, Value]:
        """Read registers, in the units the driver works in."""
        values: dict[str, Value] = {}
        for block in blocks_of(self._map, names):
            for name, each in (await self._read_block(block)).items():
                try:
                    values[name] = each.required()
                except ProtocolViolation as error:
                    raise ProtocolViolation(f"{self._link.place}: {error}") from error
        return values

    def encoded(self, values: Mapping[str, Value]) -> dict[str, tuple[int, ...]]:
        """Turn values in the units the driver works in into words."""
        registers = {name: self._map[name] for name in values}
        return {name: registers[name].encode(from_si(name, registers[name], value)) for name, value in values.items()}

    async def write(self, words: Mapping[str, tuple[int, ...]]) -> None:
        """Write registers block by block and see that they then hold what was written."""
        for block in blocks_of(self._map, words):
            sent = tuple(word for name in block.names for word in words[name])
            await self._link.write(block.kind, block.address, sent)
            held = await self._link.read(block.kind, block.address, block.count)
            if held != sent:
                raise ProtocolViolation(
                    f"{self._link.place}: {', '.join(block.names)} ({block.kind.value} {block.address}): "
                    f"expected to read back {list(sent)} as written, got {list(held)}. Look for a limit in "
                    "the PLC's program, or for another host that writes there."
                )

    async def _read_block(self, block: Block) -> dict[str, Reading]:
        words = await self._link.read(block.kind, block.address, block.count)
        readings = {}
        for name in block.names:
            register = self._map[name]
            offset = register.address - block.address
            readings[name] = reading(name, register, words[offset : offset + register.size])
        return readings


class HostWatchdog:
    """Counts beats."""

    def __init__(self, registers: NamedRegisters, place: str, timeout_s: float, clock_ns: Callable[[], int]) -> None:
        self._registers = registers
        self._place = place
        self._timeout_s = timeout_s
        self._clock_ns = clock_ns
        self._count: int | None = None
        self._seen_ns = 0

    def start_anew(self) -> None:
        """Begin at 0 with the next beat: the connection is another."""
        self._count = None

    async def beat(self) -> None:
        """Move the count on by one, and see that the PLC has seen the beats before."""
        now_ns = self._clock_ns()
        if self._count is None:
            self._seen_ns = now_ns
        else:
            await self._require_seen(self._count, now_ns)
        count = 0 if self._count is None else (self._count + 1) % COUNTS
        await self._registers.write(self._registers.encoded({"host_count": count}))
        self._count = count

    async def _require_seen(self, count: int, now_ns: int) -> None:
        seen = (await self._registers.read(("host_count_seen",)))["host_count_seen"]
        if seen == count:
            self._seen_ns = now_ns
        elif now_ns - self._seen_ns > self._timeout_s * NS_PER_S:
            raise DeviceTimeout(
                f"{self._place}: watchdog: expected beat {count} seen by the PLC within "
                f"{self._timeout_s:g} s, it has seen {seen}. Check that the PLC's program runs."
            )
