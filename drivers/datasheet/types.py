"""Numbers as an EDS writes them (CiA 306), data types by the code it gives them (CiA 301), and how values are written.

::

    16   0x10   020        the same number: a leading 0 makes it octal
    $NODEID+0x180          the node id is put in, usually for a COB-ID
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_NUMBER = re.compile(r"[+-]?(?:0x[0-9a-f]+|0[0-7]*|[1-9][0-9]*)", re.IGNORECASE)
_OCTAL = re.compile(r"[+-]?0[0-9]+")
_LONGEST = 100  # characters of a number: those of 64 bit have at most 66
_NODE_ID = "$NODEID"

OCTET_STRING = 0x0A
DOMAIN = 0x0F
UNSIGNED8 = 0x05


def read_number(text: str) -> int | None:
    """Read an integer as CiA 306 writes it (decimal, 0x hexadecimal, leading 0 octal); None for what is none."""
    text = text.strip()
    if len(text) > _LONGEST or not _NUMBER.fullmatch(text):
        return None
    return int(text, 8) if _OCTAL.fullmatch(text) else int(text, 0)


def octal_matters(text: str) -> bool:
    """Whether a leading 0 makes the number another one than its digits say, or none at all (``09``)."""
    text = text.strip()
    return len(text) <= _LONGEST and bool(_OCTAL.fullmatch(text)) and read_number(text) != int(text)


@dataclass(frozen=True, slots=True)
class Formula:
    """A number, or a sum of one and the node id."""

    constant: int  # what stands next to the node id
    of_node_id: bool = False  # whether the node id is added
    hexadecimal: bool = False  # whether the constant is written so

    def value(self, node_id: int) -> int:
        """Put the node id in."""
        return self.constant + node_id * self.of_node_id


def read_formula(text: str) -> Formula | None:
    """Read a number or a sum of numbers and at most one ``$NODEID``; None if it is neither."""
    terms = [term.strip() for term in text.upper().split("+")]
    numbers = [read_number(term) for term in terms if term != _NODE_ID]
    node_ids = len(terms) - len(numbers)
    constants = [number for number in numbers if number is not None]
    if node_ids > 1 or len(constants) < len(numbers):
        return None
    return Formula(
        constant=sum(constants), of_node_id=node_ids == 1, hexadecimal=any(term.startswith("0X") for term in terms)
    )


@dataclass(frozen=True, slots=True)
class DataType:
    """One data type."""

    code: int  # index of the type in the object dictionary
    name: str  # as CiA 301 calls it
    bits: int | None = None  # width
    signed: bool = False  # whether an integer may be negative

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
