"""The registers of a map by their names: read as values, written and read back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from drivers.errors import DeviceFault, ProtocolViolation
from drivers.plc.map_needs import from_si
from drivers.plc.modbus_link import ModbusLink
from drivers.plc.reading import Reading, reading
from drivers.plc.register import Value
from drivers.plc.register_map import Block, RegisterMap, blocks_of


class NamedRegisters:
    """Registers of one PLC; one request for each run of adjacent ones.

    Parameters
    ----------
    link
        The connection.
    register_map
        What its registers mean.
    """

    __slots__ = ("_link", "_map")

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
