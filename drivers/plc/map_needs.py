"""What the PLC driver needs of a register map: which registers, of what type, in what unit, writable or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Final

from drivers.errors import ConfigMismatch
from drivers.plc.register import Access, Register, Value, ValueType
from drivers.plc.register_map import RegisterMap
from drivers.plc.types import ClutchState, DriveMode, PrbsSource
from drivers.plc.units import IN_SI

WHOLE: Final = frozenset({ValueType.UINT16, ValueType.UINT32})
NUMBER: Final = frozenset(ValueType) - {ValueType.BOOL, ValueType.ENUM}
BOOL: Final = frozenset({ValueType.BOOL})
ENUM: Final = frozenset({ValueType.ENUM})

USED: Final[Mapping[str, tuple[frozenset[ValueType], str, Access]]] = {
    "permissive": (BOOL, "1", Access.READ),
    "drive_mode": (ENUM, "1", Access.READ),
    "clutch": (ENUM, "1", Access.READ),
    "speed_limit": (NUMBER, "rad/s", Access.READ),
    "torque_limit": (NUMBER, "Nm", Access.READ),
    "plc_count": (WHOLE, "1", Access.READ),
    "host_count_seen": (WHOLE, "1", Access.READ),
    "prbs_torque": (NUMBER, "Nm", Access.READ),
    "host_count": (WHOLE, "1", Access.READ_WRITE),
    "drive_mode_request": (ENUM, "1", Access.READ_WRITE),
    "prbs_enable": (BOOL, "1", Access.READ_WRITE),
    "prbs_amplitude": (NUMBER, "Nm", Access.READ_WRITE),
    "prbs_divider": (WHOLE, "1", Access.READ_WRITE),
    "prbs_seed": (WHOLE, "1", Access.READ_WRITE),
    "prbs_source": (ENUM, "1", Access.READ_WRITE),
}
"""What this driver needs of a map: the name, the types it can make sense of, the unit it works in, the least access."""

ENUMS: Final[Mapping[str, type[Enum]]] = {
    "drive_mode": DriveMode,
    "drive_mode_request": DriveMode,
    "clutch": ClutchState,
    "prbs_source": PrbsSource,
}
"""Enum registers, and the enumeration that holds every name the map may give them."""


def require_usable(register_map: RegisterMap) -> None:
    """See that a map holds every register of `USED` in a way that makes sense."""
    faults = [fault for name in USED for fault in _faults(register_map, name)]
    if faults:
        raise ConfigMismatch(
            f"register map {register_map.name!r}: {'; '.join(faults)}. Compare it with the shipped plc.toml."
        )


def to_si(name: str, register: Register, value: Value) -> Value:
    """Turn a register's value into the unit the driver works in."""
    factor = _factor(name, register)
    return value if factor == 1.0 or isinstance(value, str) else factor * value


def from_si(name: str, register: Register, value: Value) -> Value:
    """Turn a value of the driver into the register's unit."""
    factor = _factor(name, register)
    return value if factor == 1.0 or isinstance(value, str) else value / factor


def _factor(name: str, register: Register) -> float:
    """One of the register's unit in that of the driver; registers of the identity are compared as they are."""
    return IN_SI[USED[name][1]][register.unit] if name in USED else 1.0


def _faults(register_map: RegisterMap, name: str) -> Iterator[str]:
    register = register_map.registers.get(name)
    if register is None:
        yield f"expected a register {name}, there is none"
        return
    types, unit, access = USED[name]
    if register.type not in types:
        expected = " or ".join(sorted(each.value for each in types))
        yield f"{name}: expected type {expected}, got {register.type.value}"
    if register.unit not in IN_SI[unit]:
        yield f"{name}: expected unit {' or '.join(IN_SI[unit])}, got {register.unit}"
    if access is Access.READ_WRITE and register.access is not access:
        yield f"{name}: expected access read_write, got {register.access.value}"
    yield from _enum_faults(name, register)


def _enum_faults(name: str, register: Register) -> Iterator[str]:
    if name in ENUMS and register.values is not None:
        known = {member.value for member in ENUMS[name]}
        if unknown := sorted(set(register.values) - known):
            yield f"{name}: expected names out of {', '.join(sorted(known))}, got {', '.join(unknown)}"
