"""Numbers as an EDS writes them (CiA 306): decimal, hexadecimal, octal, and sums with the node id.

::

    16   0x10   020        the same number: a leading 0 makes it octal
    $NODEID+0x180          the node id is put in, usually for a COB-ID
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_NUMBER = re.compile(r"[+-]?(?:0x[0-9a-f]+|0[0-7]*|[1-9][0-9]*)", re.IGNORECASE)
_OCTAL = re.compile(r"[+-]?0[0-9]+")
_LONGEST = 100
"""Characters of a number: those of 64 bit have at most 66."""
_NODE_ID = "$NODEID"


def read_number(text: str) -> int | None:
    """Read one number; None if it is none."""
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
    """A number, or a sum of one and the node id.

    Attributes
    ----------
    constant
        What stands next to the node id.
    of_node_id
        Whether the node id is added.
    node_id_first
        Whether it stands in front, where CiA 306 wants it.
    hexadecimal
        Whether the constant is written so: then it may be the bit pattern of a negative number.
    """

    constant: int
    of_node_id: bool = False
    node_id_first: bool = False
    hexadecimal: bool = False

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
        constant=sum(constants),
        of_node_id=node_ids == 1,
        node_id_first=terms[0] == _NODE_ID,
        hexadecimal=any(term.startswith("0X") for term in terms),
    )
