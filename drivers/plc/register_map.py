"""The register map of a PLC: a TOML file, checked as a whole, how to read it in few requests, and what of it is used.

A map file is refused with all its faults at once, each with its key. What one entry means on the bus is in
`drivers.plc.register`. The driver works in SI: rad/s, Nm, rad, rad/s^2, and 1 for counts, states and bits. A map says
in ``unit`` what its values are in after ``scale``; a unit that is not in `IN_SI` is refused when the map is taken over,
and nothing is guessed.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final, Literal

from pydantic import Field, ValidationError

from drivers.errors import ConfigMismatch
from drivers.foreign_file import read_regular_text
from drivers.plc.register import Access, MapTable, Register, RegisterKind, Value, ValueType
from drivers.plc.types import ClutchState, DriveMode, PrbsSource

RAD_PER_TURN: Final = 2.0 * math.pi
SECONDS_PER_MINUTE: Final = 60.0

IN_SI: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
    {
        "rad/s": {
            "rad/s": 1.0,
            "1/min": RAD_PER_TURN / SECONDS_PER_MINUTE,
            "rpm": RAD_PER_TURN / SECONDS_PER_MINUTE,
            "1/s": RAD_PER_TURN,
        },
        "Nm": {"Nm": 1.0, "kNm": 1000.0},
        "rad": {"rad": 1.0, "deg": RAD_PER_TURN / 360.0},
        "rad/s^2": {"rad/s^2": 1.0},
        "1": {"1": 1.0},
    }
)
"""By the driver's unit: each unit a map may use for it, and one of it in the driver's. ``1/min`` counts turns."""


MOST_REGISTERS: Final = 125
"""Registers that one request may read; Modbus Application Protocol V1.1b3, 6.3 and 6.4."""

MOST_BITS: Final = 2000  # coils or discrete inputs that one request may read; ibid., 6.1 and 6.2

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


class RegisterMapError(ConfigMismatch):
    """A map file is wrong: whoever wrote it is at fault."""

    def __init__(self, path: Path, *problems: str) -> None:
        self.path = path
        self.problems = problems
        super().__init__("\n".join(f"{path}: {problem}" for problem in problems))


class RegisterMap(MapTable):
    """A whole map file. The key ``schema`` is `schema_id` here: pydantic has a use of its own for that name."""

    schema_id: Annotated[Literal["hil.register_map/1"], Field(alias="schema")]
    name: Annotated[str, Field(min_length=1)]  # what PLC it is for
    device_id: Annotated[int, Field(ge=0, le=255)]  # modbus unit the PLC answers as
    identity: dict[str, int]  # what the registers of these names must hold
    registers: dict[str, Register]  # the entries by name

    def __getitem__(self, name: str) -> Register:
        if name not in self.registers:
            raise ConfigMismatch(
                f"register map {self.name!r}: expected a register {name}, it has {', '.join(sorted(self.registers))}. "
                "Add it to the map file."
            )
        return self.registers[name]


@dataclass(frozen=True, slots=True)
class Block:
    """Registers of one kind at adjacent addresses: what one request reads or writes."""

    kind: RegisterKind  # coils, discrete inputs, holding or input registers
    address: int  # of the first, from 0
    count: int  # of registers
    names: tuple[str, ...]  # of the values in them


def blocks_of(map_: RegisterMap, names: Iterable[str]) -> tuple[Block, ...]:
    """Group registers into the fewest requests that touch no address outside them."""
    ordered = sorted(names, key=lambda name: (map_[name].kind.value, map_[name].address))
    blocks: list[Block] = []
    for name in ordered:
        register = map_[name]
        last = blocks[-1] if blocks else None
        if last and _continues(last, register):
            blocks[-1] = Block(last.kind, last.address, last.count + register.size, (*last.names, name))
        else:
            blocks.append(Block(register.kind, register.address, register.size, (name,)))
    return tuple(blocks)


def _continues(block: Block, register: Register) -> bool:
    most = MOST_BITS if block.kind.is_bit else MOST_REGISTERS
    adjacent = block.kind is register.kind and block.address + block.count == register.address
    return adjacent and block.count + register.size <= most


def load_register_map(path: Path) -> RegisterMap:
    """Read and check a map file."""
    try:
        data = tomllib.loads(read_regular_text(path))
    except OSError as cause:
        raise RegisterMapError(path, f"the file | expected a readable file | got: {cause.strerror}") from cause
    except (ValueError, RecursionError) as cause:  # tomllib's own error, and text that is not UTF-8
        raise RegisterMapError(path, f"the file | expected TOML in UTF-8 | got: {cause}") from cause
    try:
        map_ = RegisterMap.model_validate(data)
    except ValidationError as cause:
        raise RegisterMapError(path, *_problems(cause)) from cause
    if faults := (*_overlaps(map_.registers), *_identity_faults(map_)):
        raise RegisterMapError(path, *faults)
    return map_


def _problems(cause: ValidationError) -> Iterator[str]:
    for detail in cause.errors():
        key = ".".join(map(str, detail["loc"])) or "the file"
        if detail["type"] == "missing":
            yield f"{key} | expected this key | got nothing: add it"
        elif detail["type"] == "extra_forbidden":
            yield f"{key} | expected no such key | got this unknown key: fix or remove it"
        else:
            expected = detail["msg"].removeprefix("Input should be ")
            got = "a table" if isinstance(detail["input"], Mapping) else repr(detail["input"])
            yield f"{key} | expected {expected} | got {got}"


def _overlaps(registers: Mapping[str, Register]) -> Iterator[str]:
    for kind in RegisterKind:
        of_kind = sorted(
            ((name, register) for name, register in registers.items() if register.kind is kind),
            key=lambda entry: entry[1].address,
        )
        for (before, first), (name, register) in pairwise(of_kind):
            if register.address < first.end:
                yield (
                    f"registers.{name}.address | expected {first.end} or more, behind {before} | got {register.address}"
                )


def _identity_faults(map_: RegisterMap) -> Iterator[str]:
    if not map_.identity:
        yield "identity | expected at least one register and what it must hold | got none"
    for name, value in map_.identity.items():
        if name not in map_.registers:
            yield f"identity.{name} | expected the name of a register of this map | got {name!r}"
        else:
            yield from _value_faults(f"identity.{name}", map_[name], value)


def _value_faults(key: str, register: Register, value: int) -> Iterator[str]:
    try:
        register.encode(value)
    except ConfigMismatch:
        yield f"{key} | expected a value that {register.type.value} holds | got {value}"


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
