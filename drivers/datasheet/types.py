"""Data types of CiA 301 by the code an EDS gives them, and how their values are written."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.datasheet.number import read_formula


@dataclass(frozen=True, slots=True)
class DataType:
    """One data type.

    Attributes
    ----------
    code
        Index of the type in the object dictionary.
    name
        As CiA 301 calls it.
    bits
        Width; None where it varies (texts, domains).
    signed
        Whether an integer may be negative.
    """

    code: int
    name: str
    bits: int | None = None
    signed: bool = False

    @property
    def is_integer(self) -> bool:
        """Whether its values are whole numbers; a BOOLEAN is 0 or 1."""
        return self.bits is not None and not self.is_real

    @property
    def is_real(self) -> bool:
        """Whether its values are floating-point numbers."""
        return self.name.startswith("REAL")

    @property
    def low(self) -> int:
        """Least value of an integer."""
        return -(1 << (self.bits or 1) - 1) if self.signed else 0

    @property
    def high(self) -> int:
        """Greatest value of an integer."""
        return (1 << (self.bits or 1) - self.signed) - 1

    def integer(self, text: str, node_id: int) -> int | None:
        """Read an integer of this type; None if it is none, or outside the type's range.

        A hexadecimal number is the bit pattern, so that ``0xFFFF`` is -1 in an INTEGER16.
        """
        formula = read_formula(text)
        if formula is None:
            return None
        value = formula.value(node_id)
        if formula.hexadecimal and self.high < value <= self.high - self.low:
            value -= self.high - self.low + 1
        return value if self.low <= value <= self.high else None


def _integers(signed: dict[int, int], unsigned: dict[int, int]) -> tuple[DataType, ...]:
    return (
        *(DataType(code, f"INTEGER{bits}", bits, signed=True) for code, bits in signed.items()),
        *(DataType(code, f"UNSIGNED{bits}", bits) for code, bits in unsigned.items()),
    )


DATA_TYPES: dict[int, DataType] = {
    kind.code: kind
    for kind in (
        DataType(0x01, "BOOLEAN", 1),
        *_integers(
            {0x02: 8, 0x03: 16, 0x04: 32, 0x10: 24, 0x12: 40, 0x13: 48, 0x14: 56, 0x15: 64},
            {0x05: 8, 0x06: 16, 0x07: 32, 0x16: 24, 0x18: 40, 0x19: 48, 0x1A: 56, 0x1B: 64},
        ),
        DataType(0x08, "REAL32", 32),
        DataType(0x11, "REAL64", 64),
        DataType(0x09, "VISIBLE_STRING"),
        DataType(0x0A, "OCTET_STRING"),
        DataType(0x0B, "UNICODE_STRING"),
        DataType(0x0C, "TIME_OF_DAY"),
        DataType(0x0D, "TIME_DIFFERENCE"),
        DataType(0x0F, "DOMAIN"),
    )
}
"""Simple data types, CiA 301 table 44; 0x0E and 0x17 are reserved."""

OCTET_STRING = 0x0A
DOMAIN = 0x0F
UNSIGNED8 = 0x05
