"""What is exported, as data: the program organization units (POU) of IEC 61131-3 and the data types they share.

Structured Text and PLCopen XML are two printings of a `Project`; neither has a text of its own. A body is Structured
Text in both.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class PouKind(Enum):
    """The kinds of POU that are exported; the value is the keyword."""

    FUNCTION_BLOCK = "FUNCTION_BLOCK"
    PROGRAM = "PROGRAM"


class SectionKind(Enum):
    """What a section declares; the value is its keyword."""

    INPUT = "VAR_INPUT"
    OUTPUT = "VAR_OUTPUT"
    LOCAL = "VAR"


@dataclass(frozen=True, slots=True)
class Array:
    """``ARRAY[low..high, ..] OF element``; the element is of an elementary type."""

    bounds: tuple[tuple[int, int], ...]
    element: str


@dataclass(frozen=True, slots=True)
class DataType:
    """A named array type. Arrays that are handed over have one: two unnamed array types are never the same type."""

    name: str
    array: Array
    comment: str


@dataclass(frozen=True, slots=True)
class Variable:
    """A declaration; ``initial`` holds no, one, or (of an array) each literal; ``type`` is a name or an array."""

    name: str
    type: str | Array
    initial: tuple[str, ...]
    comment: str


@dataclass(frozen=True, slots=True)
class Section:
    """``VAR .. END_VAR``; ``comment`` says what its variables have in common, or nothing."""

    kind: SectionKind
    constant: bool
    variables: tuple[Variable, ...]
    comment: str


@dataclass(frozen=True, slots=True)
class Pou:
    """A program organization unit; ``body`` is Structured Text without the last newline."""

    kind: PouKind
    name: str
    sections: tuple[Section, ...]
    body: str
    comment: str


@dataclass(frozen=True, slots=True)
class Project:
    """Data types and POUs, each after those it uses; ``comment`` says where they come from."""

    types: tuple[DataType, ...]
    pous: tuple[Pou, ...]
    comment: str
