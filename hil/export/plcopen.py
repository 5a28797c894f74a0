"""The estimator as PLCopen XML (TC6): what CODESYS, TwinCAT and others import in one step.

Interfaces are declared element by element, so they are read from the Structured Text as it is laid out in ``st/``: a
comment before each POU, one declaration at a time, its comment after it, keywords at the start of a line. Bodies are
Structured Text in ``<ST>``. Texts are in ``xhtml:p``, the one element that Beremiz reads them from.

Source: PLCopen TC6, XML Formats for IEC 61131-3, version 2.01 (2009).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import datetime
from inspect import cleandoc
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from hil.export import Tc6
from hil.export.plc_estimator import PlcEstimator
from hil.export.structured_text import Precision, parts
from hil.version import __version__

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


XHTML: Final = "http://www.w3.org/1999/xhtml"

ELEMENTARY: Final = frozenset(("BOOL", "INT", "DINT", "REAL", "LREAL"))
"""Types that are an element of their own name; every other is ``<derived name=".."/>``."""

_POU_TYPE: Final = {"FUNCTION_BLOCK": "functionBlock", "PROGRAM": "program"}
_VARIABLES: Final = {"VAR_INPUT": "inputVars", "VAR_OUTPUT": "outputVars", "VAR": "localVars"}


def plcopen_xml(
    estimator: PlcEstimator, written: datetime, precision: Precision = Precision.DOUBLE, version: Tc6 = Tc6.V2_01
) -> str:
    """Return the POUs of an estimator, and the data types they share, as a document."""
    head, data_types, pous = parts(estimator, precision)
    comment = re.fullmatch(_COMMENT, head.strip(), re.S)
    assert comment is not None  # noqa: S101 - the head is one comment
    root = Element("project", {"xmlns": version.namespace, "xmlns:xhtml": XHTML})
    _headers(root, _plain(comment["comment"]), written.isoformat(timespec="seconds"))
    types = SubElement(root, "types")
    of_data, of_pous = SubElement(types, "dataTypes"), SubElement(types, "pous")
    for found in _each(_TYPE, data_types):
        _data_type(of_data, found)
    for text in pous:
        (found,) = _each(_POU, text)
        _pou(of_pous, found)
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


def _data_type(parent: Element, found: re.Match[str]) -> None:
    element = SubElement(parent, "dataType", {"name": found["name"]})
    _type(SubElement(element, "baseType"), found["type"])
    _documentation(element, found["comment"])


def _pou(parent: Element, found: re.Match[str]) -> None:
    element = SubElement(parent, "pou", {"name": found["name"], "pouType": _POU_TYPE[found["kind"]]})
    interface = SubElement(element, "interface")
    for section in _each(_SECTION, found["sections"]):
        _section(interface, section)
    _documentation(interface, found["comment"])
    _text(SubElement(SubElement(element, "body"), "ST"), found["body"])


def _section(parent: Element, found: re.Match[str]) -> None:
    element = SubElement(parent, _VARIABLES[found["kind"]], {"constant": "true"} if found["constant"] else {})
    for variable in _each(_VARIABLE, found["variables"]):
        _variable(element, variable)
    _documentation(element, found["comment"])


def _variable(parent: Element, found: re.Match[str]) -> None:
    element = SubElement(parent, "variable", {"name": found["name"]})
    _type(SubElement(element, "type"), found["type"])
    if found["initial"]:
        _initial(SubElement(element, "initialValue"), found["initial"])
    _documentation(element, found["comment"])


def _type(parent: Element, text: str) -> None:
    array = _ARRAY.fullmatch(text)
    if array is not None:
        element = SubElement(parent, "array")
        for bounds in array["bounds"].split(","):
            low, high = bounds.split("..")
            SubElement(element, "dimension", {"lower": low.strip(), "upper": high.strip()})
        _type(SubElement(element, "baseType"), array["element"])
    elif text in ELEMENTARY:
        SubElement(parent, text)
    else:
        SubElement(parent, "derived", {"name": text})


def _initial(parent: Element, text: str) -> None:
    """Write one literal, or of an array, which is in brackets, each."""
    literals = re.findall(r"[^\[\],\s]+", text)
    if not text.startswith("["):
        SubElement(parent, "simpleValue", {"value": literals[0]})
        return
    values = SubElement(parent, "arrayValue")
    for literal in literals:
        SubElement(SubElement(values, "value"), "simpleValue", {"value": literal})


def _documentation(parent: Element, comment: str | None) -> None:
    if comment:
        _text(SubElement(parent, "documentation"), _plain(comment))


def _text(parent: Element, text: str) -> None:
    SubElement(parent, "xhtml:p").text = text


def _each(pattern: re.Pattern[str], text: str) -> Iterator[re.Match[str]]:
    """Yield one match after the other, with nothing between them."""
    place = 0
    while place < len(text):
        found = pattern.match(text, place)
        if found is None:
            raise ValueError(f"not laid out as the files of st/ are: {text[place : place + 60]!r}")
        yield found
        place = found.end()


def _plain(comment: str) -> str:
    """Return the lines of a comment without the indentation they have in common."""
    return cleandoc(comment.strip())
