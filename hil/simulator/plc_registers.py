"""The simulated PLC's registers as pymodbus's server asks for them: words from and to the device."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.simulator import DataType, SimData, SimDevice
from pymodbus.simulator.simcore import SimCore

from drivers.errors import ConfigMismatch, ProtocolViolation
from drivers.plc.register import Access, Register, RegisterKind, Value, ValueType, WordOrder
from drivers.plc.register_map import RegisterMap
from hil.simulator.plc_device import PlcDevice, ValueRefusedError

KIND: Final = {
    1: RegisterKind.COIL,
    2: RegisterKind.DISCRETE_INPUT,
    3: RegisterKind.HOLDING_REGISTER,
    4: RegisterKind.INPUT_REGISTER,
    5: RegisterKind.COIL,
    6: RegisterKind.HOLDING_REGISTER,
    15: RegisterKind.COIL,
    16: RegisterKind.HOLDING_REGISTER,
}
"""What each function code works on; Modbus Application Protocol V1.1b3, section 6."""


class PlcRegisters(SimCore):
    """pymodbus's view of the device: the two methods its server calls, for exactly the addresses of the map.

    Parameters
    ----------
    device : PlcDevice
        Holds all values.
    register_map : RegisterMap
        Where they are.

    Raises
    ------
    ConfigMismatch
        If the map has a register that the device knows nothing of.
    """

    def __init__(self, device: PlcDevice, register_map: RegisterMap) -> None:
        super().__init__(SimDevice(0, SimData(0, values=0, datatype=DataType.REGISTERS)))
        if unknown := sorted(set(register_map.registers) - set(device.values())):
            raise ConfigMismatch(
                f"register map {register_map.name!r}: expected registers the simulated PLC knows, got "
                f"{', '.join(unknown)}. Use the shipped plc.toml with the simulated PLC."
            )
        self._device = device
        self._map = register_map

    async def async_getValues(  # noqa: N802 - pymodbus's name
        self, device_id: int, func_code: int, address: int, count: int = 1
    ) -> list[int] | list[bool] | ExcCodes:
        """Answer a read, or say why not."""
        self._require_device(device_id)
        kind = KIND.get(func_code)
        if kind is None:
            return ExcCodes.ILLEGAL_FUNCTION
        image = self._image(kind)
        if any(each not in image for each in range(address, address + count)):
            return ExcCodes.ILLEGAL_ADDRESS
        words = [image[each] for each in range(address, address + count)]
        return [bool(word) for word in words] if kind.is_bit else words

    async def async_setValues(  # noqa: N802 - pymodbus's name
        self, device_id: int, func_code: int, address: int, values: Sequence[int] | Sequence[bool]
    ) -> ExcCodes | None:
        """Take a write, or say why not."""
        self._require_device(device_id)
        kind = KIND.get(func_code)
        if kind is None:
            return ExcCodes.ILLEGAL_FUNCTION
        names = self._written(kind, address, len(values))
        if names is None:
            return ExcCodes.ILLEGAL_ADDRESS
        try:
            self._device.write({name: self._decoded(name, address, values) for name in names})
        except (ProtocolViolation, ValueRefusedError):
            return ExcCodes.ILLEGAL_VALUE
        return None

    def _require_device(self, device_id: int) -> None:
        if device_id != self._map.device_id:
            raise NoSuchIdException(f"expected device id {self._map.device_id}, got {device_id}")

    def _image(self, kind: RegisterKind) -> dict[int, int]:
        """Put every register of a kind into words, by address."""
        values = self._device.values()
        return {
            register.address + offset: word
            for name, register in self._map.registers.items()
            if register.kind is kind
            for offset, word in enumerate(self._ordered(register).encode(values[name]))
        }

    def _ordered(self, register: Register) -> Register:
        """Give a register as this PLC has it: a fault of its own may have the words of floats the other way round."""
        if register.type is not ValueType.FLOAT32 or not self._device.swaps_floats:
            return register
        other = next(each for each in WordOrder if each is not register.word_order)
        return register.model_copy(update={"word_order": other})

    def _written(self, kind: RegisterKind, address: int, count: int) -> list[str] | None:
        """Name the registers that make up a range; None unless it is writable registers from end to end."""
        inside = {
            name: register
            for name, register in self._map.registers.items()
            if register.kind is kind
            and register.access is Access.READ_WRITE
            and address <= register.address
            and register.end <= address + count
        }
        covered = sum(register.size for register in inside.values())
        return list(inside) if covered == count else None

    def _decoded(self, name: str, address: int, values: Sequence[int] | Sequence[bool]) -> Value:
        register = self._map[name]
        offset = register.address - address
        return self._ordered(register).decode([int(value) for value in values[offset : offset + register.size]])
