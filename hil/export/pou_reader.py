"""Reads the files of ``st/``, filled in, into POUs and data types.

It reads how those files are laid out, which is a part of Structured Text: a comment before each POU, one declaration at
a time, its comment after it, POU and section keywords at the start of a line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from inspect import cleandoc
from typing import Final

from hil.export.pou import Array, DataType, Pou, PouKind, Section, SectionKind, Variable

_COMMENT: Final = r"\(\*(?P<comment>(?:(?!\(\*|\*\)).)*)\*\)"

_POU: Final = re.compile(
    rf"{_COMMENT}\n(?P<kind>FUNCTION_BLOCK|PROGRAM)\ (?P<name>\w+)\n(?P<sections>(?:VAR.*?^END_VAR\n)+)\n"
    r"(?P<body>.*?)\nEND_(?P=kind)\n",
    re.X | re.S | re.M,
)
_SECTION: Final = re.compile(
    rf"^(?P<kind>VAR\w*)(?P<constant>\ CONSTANT)?(?:\ +{_COMMENT})?\n(?P<variables>.*?)^END_VAR\n", re.X | re.S | re.M
)
_TYPE: Final = re.compile(rf"^TYPE\n\ +(?P<name>\w+)\ :\ (?P<type>[^;]+);\ +{_COMMENT}\nEND_TYPE\n", re.X | re.S | re.M)
_VARIABLE: Final = re.compile(
    rf"\s+(?P<name>\w+)\s*:\s*(?P<type>[^:;]+?)(?:\s*:=\s*(?P<initial>[^;]+))?;(?:\ +{_COMMENT})?\n", re.X | re.S
)
_ARRAY: Final = re.compile(r"ARRAY\[(?P<bounds>[^\]]+)\] OF (?P<element>\w+)")


def read_types(text: str) -> tuple[DataType, ...]:
    """Return the data types of a text."""
    return tuple(
        DataType(found["name"], _array(found["type"]), _plain(found["comment"])) for found in _each(_TYPE, text)
    )


def read_pou(text: str) -> Pou:
    """Return the one POU of a text."""
    (found,) = _each(_POU, text)
    return Pou(
        PouKind(found["kind"]), found["name"], _sections(found["sections"]), found["body"], _plain(found["comment"])
    )


def _sections(text: str) -> tuple[Section, ...]:
    return tuple(
        Section(
            SectionKind(found["kind"]),
            found["constant"] is not None,
            tuple(_variable(entry) for entry in _each(_VARIABLE, found["variables"])),
            _plain(found["comment"]),
        )
        for found in _each(_SECTION, text)
    )


def _variable(found: re.Match[str]) -> Variable:
    initial = tuple(re.findall(r"[^\[\],\s]+", found["initial"] or ""))
    kind = _array(found["type"]) if found["type"].startswith("ARRAY") else found["type"]
    return Variable(found["name"], kind, initial, _plain(found["comment"]))


def _array(text: str) -> Array:
    found = _ARRAY.fullmatch(text)
    if found is None:
        raise ValueError(f"expected ARRAY[low..high] OF name, got {text!r}")
    bounds = (tuple(map(int, part.split(".."))) for part in found["bounds"].split(","))
    return Array(tuple((low, high) for low, high in bounds), found["element"])


def _each(pattern: re.Pattern[str], text: str) -> Iterator[re.Match[str]]:
    """Yield one match after the other, with nothing between them."""
    place = 0
    while place < len(text):
        found = pattern.match(text, place)
        if found is None:
            raise ValueError(f"not laid out as the files of st/ are: {text[place : place + 60]!r}")
        yield found
        place = found.end()


def _plain(comment: str | None) -> str:
    """Return the lines of a comment without the indentation they have in common."""
    return cleandoc((comment or "").strip())
