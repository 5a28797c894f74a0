"""What the PLC driver needs of a register map: which registers, of what type, writable or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Final

from drivers.errors import ConfigMismatch
from drivers.plc_types import ClutchState, DriveMode, PrbsSource
from drivers.register import Access, Register, ValueType
from drivers.register_map import RegisterMap

WHOLE: Final = frozenset({ValueType.UINT16, ValueType.UINT32})
NUMBER: Final = frozenset(ValueType) - {ValueType.BOOL, ValueType.ENUM}
BOOL: Final = frozenset({ValueType.BOOL})
ENUM: Final = frozenset({ValueType.ENUM})

USED: Final[Mapping[str, tuple[frozenset[ValueType], Access]]] = {
    "permissive": (BOOL, Access.READ),
    "drive_mode": (ENUM, Access.READ),
    "clutch": (ENUM, Access.READ),
    "speed_limit": (NUMBER, Access.READ),
    "torque_limit": (NUMBER, Access.READ),
    "plc_count": (WHOLE, Access.READ),
    "host_count_seen": (WHOLE, Access.READ),
    "host_count": (WHOLE, Access.READ_WRITE),
    "drive_mode_request": (ENUM, Access.READ_WRITE),
    "prbs_enable": (BOOL, Access.READ_WRITE),
    "prbs_amplitude": (NUMBER, Access.READ_WRITE),
    "prbs_divider": (WHOLE, Access.READ_WRITE),
    "prbs_seed": (WHOLE, Access.READ_WRITE),
    "prbs_source": (ENUM, Access.READ_WRITE),
}
"""What this driver needs of a map: the name, the types it can make sense of, the least access."""

ENUMS: Final[Mapping[str, type[Enum]]] = {
    "drive_mode": DriveMode,
    "drive_mode_request": DriveMode,
    "clutch": ClutchState,
    "prbs_source": PrbsSource,
}
"""Enum registers, and the enumeration that holds every name the map may give them."""


def require_usable(register_map: RegisterMap) -> None:
    """See that a map holds every register of `USED` in a way that makes sense.

    Raises
    ------
    ConfigMismatch
        Naming every register that is missing or makes no sense.
    """
    faults = [fault for name in USED for fault in _faults(register_map, name)]
    if faults:
        raise ConfigMismatch(
            f"register map {register_map.name!r}: {'; '.join(faults)}. Compare it with the shipped plc.toml."
        )


def _faults(register_map: RegisterMap, name: str) -> Iterator[str]:
    register = register_map.registers.get(name)
    if register is None:
        yield f"expected a register {name}, there is none"
        return
    types, access = USED[name]
    if register.type not in types:
        expected = " or ".join(sorted(each.value for each in types))
        yield f"{name}: expected type {expected}, came {register.type.value}"
    if access is Access.READ_WRITE and register.access is not access:
        yield f"{name}: expected access read_write, came {register.access.value}"
    yield from _enum_faults(name, register)


def _enum_faults(name: str, register: Register) -> Iterator[str]:
    if name in ENUMS and register.values is not None:
        known = {member.value for member in ENUMS[name]}
        if unknown := sorted(set(register.values) - known):
            yield f"{name}: expected names out of {', '.join(sorted(known))}, came {', '.join(unknown)}"
