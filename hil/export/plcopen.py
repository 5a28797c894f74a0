"""The estimator as PLCopen XML (TC6): what CODESYS, TwinCAT and others import in one step.

Interfaces are declared element by element, so they are read from the Structured Text as it is laid out in ``st/``: a
comment before each POU, one declaration at a time, its comment after it, keywords at the start of a line. Bodies are
Structured Text in ``<ST>``. Texts are in ``xhtml:p``, the one element that Beremiz reads them from.

Source: PLCopen TC6, XML Formats for IEC 61131-3, version 2.01 (2009).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from inspect import cleandoc
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from hil.export import Tc6
from hil.export.plc_estimator import PlcEstimator
from hil.export.structured_text import Precision, parts
from hil.version import __version__


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


def project(estimator: PlcEstimator, precision: Precision = Precision.DOUBLE) -> Project:
    """Return the POUs of an estimator, and the data types they share."""
    head, types, pous = parts(estimator, precision)
    comment = re.fullmatch(_COMMENT, head.strip(), re.S)
    assert comment is not None  # noqa: S101 - the head is one comment
    return Project(read_types(types), tuple(read_pou(text) for text in pous), _plain(comment["comment"]))


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
            tuple(_read_variable(entry) for entry in _each(_VARIABLE, found["variables"])),
            _plain(found["comment"]),
        )
        for found in _each(_SECTION, text)
    )


def _read_variable(found: re.Match[str]) -> Variable:
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


XHTML: Final = "http://www.w3.org/1999/xhtml"

ELEMENTARY: Final = frozenset(("BOOL", "INT", "DINT", "REAL", "LREAL"))
"""Types that are an element of their own name; every other is ``<derived name=".."/>``."""

_POU_TYPE: Final = {PouKind.FUNCTION_BLOCK: "functionBlock", PouKind.PROGRAM: "program"}
_VARIABLES: Final = {SectionKind.INPUT: "inputVars", SectionKind.OUTPUT: "outputVars", SectionKind.LOCAL: "localVars"}


def plcopen_xml(project: Project, written: datetime, version: Tc6 = Tc6.V2_01) -> str:
    """Return the document."""
    root = Element("project", {"xmlns": version.namespace, "xmlns:xhtml": XHTML})
    _headers(root, project.comment, written.isoformat(timespec="seconds"))
    types = SubElement(root, "types")
    data_types, pous = SubElement(types, "dataTypes"), SubElement(types, "pous")
    for kind in project.types:
        _data_type(data_types, kind)
    for pou in project.pous:
        _pou(pous, pou)
    SubElement(SubElement(root, "instances"), "configurations")
    indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{tostring(root, encoding="unicode")}\n'


def _headers(root: Element, comment: str, written: str) -> None:
    header = {"companyName": "", "productName": "hil", "productVersion": __version__, "creationDateTime": written}
    SubElement(root, "fileHeader", header)
    content = SubElement(root, "contentHeader", {"name": "HilEstimator"})
    SubElement(content, "Comment").text = comment
    coordinates = SubElement(content, "coordinateInfo")
    for language in ("fbd", "ld", "sfc"):
        SubElement(SubElement(coordinates, language), "scaling", {"x": "1", "y": "1"})


def _data_type(parent: Element, kind: DataType) -> None:
    element = SubElement(parent, "dataType", {"name": kind.name})
    _type(SubElement(element, "baseType"), kind.array)
    _documentation(element, kind.comment)


def _pou(parent: Element, pou: Pou) -> None:
    element = SubElement(parent, "pou", {"name": pou.name, "pouType": _POU_TYPE[pou.kind]})
    interface = SubElement(element, "interface")
    for section in pou.sections:
        _section(interface, section)
    _documentation(interface, pou.comment)
    _text(SubElement(SubElement(element, "body"), "ST"), pou.body)


def _section(parent: Element, section: Section) -> None:
    element = SubElement(parent, _VARIABLES[section.kind], {"constant": "true"} if section.constant else {})
    for variable in section.variables:
        _variable(element, variable)
    _documentation(element, section.comment)


def _variable(parent: Element, variable: Variable) -> None:
    element = SubElement(parent, "variable", {"name": variable.name})
    _type(SubElement(element, "type"), variable.type)
    if variable.initial:
        _initial(SubElement(element, "initialValue"), variable)
    _documentation(element, variable.comment)


def _type(parent: Element, kind: str | Array) -> None:
    if isinstance(kind, Array):
        array = SubElement(parent, "array")
        for low, high in kind.bounds:
            SubElement(array, "dimension", {"lower": str(low), "upper": str(high)})
        _type(SubElement(array, "baseType"), kind.element)
    elif kind in ELEMENTARY:
        SubElement(parent, kind)
    else:
        SubElement(parent, "derived", {"name": kind})


def _initial(parent: Element, variable: Variable) -> None:
    if not isinstance(variable.type, Array):
        SubElement(parent, "simpleValue", {"value": variable.initial[0]})
        return
    values = SubElement(parent, "arrayValue")
    for literal in variable.initial:
        SubElement(SubElement(values, "value"), "simpleValue", {"value": literal})


def _documentation(parent: Element, comment: str) -> None:
    if comment:
        _text(SubElement(parent, "documentation"), comment)


def _text(parent: Element, text: str) -> None:
    SubElement(parent, "xhtml:p").text = text
