"""Prints a project as PLCopen XML (TC6): what CODESYS, TwinCAT and others import in one step.

Interfaces are declared element by element, bodies are Structured Text in ``<ST>``. Texts are in ``xhtml:p``, the one
element that Beremiz reads them from.

Source: PLCopen TC6, XML Formats for IEC 61131-3, version 2.01 (2009).
"""

from __future__ import annotations

from datetime import datetime
from enum import Enum
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from hil import __version__
from hil.export.pou import Array, DataType, Pou, PouKind, Project, Section, SectionKind, Variable

XHTML: Final = "http://www.w3.org/1999/xhtml"

ELEMENTARY: Final = frozenset(("BOOL", "INT", "DINT", "REAL", "LREAL"))
"""Types that are an element of their own name; every other is ``<derived name=".."/>``."""

_POU_TYPE: Final = {PouKind.FUNCTION_BLOCK: "functionBlock", PouKind.PROGRAM: "program"}
_VARIABLES: Final = {SectionKind.INPUT: "inputVars", SectionKind.OUTPUT: "outputVars", SectionKind.LOCAL: "localVars"}


class Tc6(Enum):
    """Versions of the format. What is written here is the same in both but for the namespace."""

    V2_01 = "2.01"
    V2_0 = "2.0"

    @property
    def namespace(self) -> str:
        """The namespace of its elements."""
        return {Tc6.V2_01: "http://www.plcopen.org/xml/tc6_0201", Tc6.V2_0: "http://www.plcopen.org/xml/tc6_0200"}[self]


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
