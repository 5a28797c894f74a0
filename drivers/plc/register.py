"""One register of the PLC: what it is, and words on the bus to a typed value and back. No bus, no clock.

Rules:

1. nothing is guessed: word order, scale and access stand in the map file, and a key that is missing or means
   nothing there is a fault;
2. a value that does not fit its register raises and is never wrapped round or clamped;
3. words that mean nothing (an enum number the map does not know, a NaN) raise and are never passed on.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import Annotated, Final, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from drivers.errors import ConfigMismatch, ProtocolViolation

Value = bool | int | float | str
"""A register's value: bool, a number in the register's unit, or the name of an enum's member."""


ADDRESSES: Final = 65536  # addresses in each of the four tables of a Modbus device


class RegisterKind(Enum):
    """The four tables of a Modbus device; the value is the name in the map file."""

    COIL = "coil"
    DISCRETE_INPUT = "discrete_input"
    HOLDING_REGISTER = "holding_register"
    INPUT_REGISTER = "input_register"

    @property
    def is_bit(self) -> bool:
        """Whether an address holds one bit instead of 16."""
        return self in (RegisterKind.COIL, RegisterKind.DISCRETE_INPUT)

    @property
    def is_writable(self) -> bool:
        """Whether Modbus has a function that writes it."""
        return self in (RegisterKind.COIL, RegisterKind.HOLDING_REGISTER)


class ValueType(Enum):
    """Types of values; the value is the name in the map file."""

    BOOL = "bool"
    UINT16 = "uint16"
    INT16 = "int16"
    UINT32 = "uint32"
    INT32 = "int32"
    FLOAT32 = "float32"
    ENUM = "enum"


class WordOrder(Enum):
    """Which 16 bits of a 32-bit value stand at the lower address."""

    HIGH_WORD_FIRST = "high_word_first"
    LOW_WORD_FIRST = "low_word_first"


class Access(Enum):
    """What the host may do with a register."""

    READ = "read"
    READ_WRITE = "read_write"


_STRUCT: Final[Mapping[ValueType, str]] = {
    ValueType.UINT16: ">H",
    ValueType.INT16: ">h",
    ValueType.UINT32: ">I",
    ValueType.INT32: ">i",
    ValueType.FLOAT32: ">f",
    ValueType.ENUM: ">H",
}
"""Bytes of each type that registers hold, most significant first: Modbus sends each word that way."""

_INTEGERS: Final = (ValueType.UINT16, ValueType.INT16, ValueType.UINT32, ValueType.INT32)


class MapTable(BaseModel):
    """A table of the map file: strict, frozen, and without keys that mean nothing."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class Register(MapTable):
    """One entry of the map; the keys are explained at the head of ``eds/plc.toml``."""

    kind: Annotated[RegisterKind, Field(strict=False)]
    address: Annotated[int, Field(ge=0, le=65535)]
    type: Annotated[ValueType, Field(strict=False)]
    access: Annotated[Access, Field(strict=False)]
    unit: Annotated[str, Field(min_length=1)]
    description: Annotated[str, Field(min_length=1)]
    word_order: Annotated[WordOrder, Field(strict=False)] | None = None
    scale: Annotated[float, Field(gt=0)] | None = None
    values: dict[str, Annotated[int, Field(ge=0, le=65535)]] | None = None

    @property
    def size(self) -> int:
        """Addresses it takes: 1, or 2 for 32 bits in registers."""
        return 1 if self.kind.is_bit else struct.calcsize(_STRUCT[self.type]) // 2

    @property
    def end(self) -> int:
        """The first address behind it."""
        return self.address + self.size

    def encode(self, value: Value) -> tuple[int, ...]:
        """Put a value into words."""
        if self.type is ValueType.BOOL:
            if not isinstance(value, bool):
                raise self._unfit(value, "True or False")
            return (int(value),)
        return self._ordered(self._words(value))

    def decode(self, words: Sequence[int]) -> Value:
        """Return the value in SI of the raw words; ProtocolViolation if they are too few, too many or no such value."""
        if len(words) != self.size:
            raise ProtocolViolation(
                f"{self._place}: expected {self.size} word(s), got {len(words)}. Compare the register map "
                "with the PLC's program."
            )
        if self.type is ValueType.BOOL:
            return bool(words[0])
        raw = struct.unpack(_STRUCT[self.type], struct.pack(f">{self.size}H", *self._ordered(tuple(words))))[0]
        return self._meaning(raw)

    def _words(self, value: Value) -> tuple[int, ...]:
        try:
            packed = struct.pack(_STRUCT[self.type], self._raw(value))
        except (struct.error, OverflowError) as cause:
            raise self._unfit(value, f"a number that fits {self.type.value}{self._scaled}") from cause
        return struct.unpack(f">{self.size}H", packed)

    def _raw(self, value: Value) -> int | float:
        """Turn a value into the number on the bus."""
        if self.values is not None:
            if value not in self.values:
                raise self._unfit(value, f"one of {', '.join(self.values)}")
            return self.values[str(value)]
        if isinstance(value, bool | str) or not math.isfinite(value):
            raise self._unfit(value, "a finite number")
        if self.scale is not None:
            return round(value / self.scale)
        if self.type in _INTEGERS and value != int(value):
            raise self._unfit(value, "a whole number")
        return float(value) if self.type is ValueType.FLOAT32 else int(value)

    def _meaning(self, raw: int | float) -> Value:
        """Turn the number on the bus into a value."""
        if self.values is not None:
            names = {number: name for name, number in self.values.items()}
            if raw not in names:
                raise self._meaningless(f"one of {self.values}", raw)
            return names[int(raw)]
        if not math.isfinite(raw):
            raise self._meaningless("a finite number", raw)
        return raw if self.scale is None else raw * self.scale

    def _ordered(self, words: tuple[int, ...]) -> tuple[int, ...]:
        """Swap between most-significant-first and the order of addresses; its own inverse."""
        return words[::-1] if self.word_order is WordOrder.LOW_WORD_FIRST else words

    @property
    def _place(self) -> str:
        return f"{self.kind.value} {self.address} ({self.description.rstrip('.')})"

    @property
    def _scaled(self) -> str:
        return "" if self.scale is None else f" in steps of {self.scale:g} {self.unit}"

    def _unfit(self, value: Value, expected: str) -> ConfigMismatch:
        return ConfigMismatch(
            f"{self._place}: expected {expected}, got {value!r}. Compare the rig file with the register map."
        )

    def _meaningless(self, expected: str, raw: int | float) -> ProtocolViolation:
        return ProtocolViolation(
            f"{self._place}: expected {expected}, got {raw!r}. Compare the register map, word order "
            "included, with the PLC's program."
        )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if faults := tuple(self._faults()):
            raise PydanticCustomError("register", "{faults}", {"faults": "; ".join(faults)})
        return self

    def _faults(self) -> Iterator[str]:
        if self.kind.is_bit != (self.type is ValueType.BOOL):
            yield f"type bool for coils and discrete inputs and only there, got type {self.type.value}"
            return
        given = f"got type {self.type.value}"
        if self.end > ADDRESSES:
            yield f"all of it below address {ADDRESSES}, got address {self.address} for {self.size} words"
        if (self.word_order is not None) != (self.size == 2):
            yield f"word_order for 32-bit types and only there, {given}"
        if self.scale is not None and self.type not in _INTEGERS:
            yield f"scale for integer types only, {given}"
        if bool(self.values) != (self.type is ValueType.ENUM):
            yield f"values for type enum and only there, {given}"
        if len(set((self.values or {}).values())) != len(self.values or {}):
            yield f"another number for each name of values, got {self.values}"
        if self.access is Access.READ_WRITE and not self.kind.is_writable:
            yield f"access read, since Modbus can't write a {self.kind.value}, got read_write"
