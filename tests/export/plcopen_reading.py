"""PLCopen XML read by another library, ``plcopen`` of PyPI, and written down as Structured Text.

Its classes were generated from the TC6 schema. It refuses elements and attributes that the schema has not got.
"""

from collections.abc import Iterator
from typing import Any

import plcopen
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.parsers.config import ParserConfig

ELEMENTARY = {"bool_value": "BOOL", "int_value": "INT", "dint": "DINT", "real": "REAL", "lreal": "LREAL"}
KEYWORD = {"functionBlock": "FUNCTION_BLOCK", "program": "PROGRAM"}


def read_plcopen(text: str) -> Any:
    """Return the project."""
    config = ParserConfig(fail_on_unknown_properties=True, fail_on_unknown_attributes=True)
    return XmlParser(config=config).from_string(text, plcopen.Project)


def text_of(element: Any) -> str:
    """Return the text of a body or a documentation."""
    inner = element.w3_org_1999_xhtml_element
    assert inner.qname == "{http://www.w3.org/1999/xhtml}p", "Beremiz reads no other element"
    return str(inner.text)


def as_structured_text(project: Any) -> str:
    """Return data types and POUs as one text, without comments."""
    types = (f"TYPE {kind.name} : {type_of(kind.base_type)}; END_TYPE" for kind in project.types.data_types.data_type)
    return "\n".join((*types, *map(_pou, project.types.pous.pou)))


def _pou(pou: Any) -> str:
    keyword = KEYWORD[pou.pou_type.value]
    (body,) = pou.body
    return "\n".join((f"{keyword} {pou.name}", *_sections(pou.interface), text_of(body.st), f"END_{keyword}"))


def _sections(interface: Any) -> Iterator[str]:
    for keyword, section in sections_of(interface):
        lines = (f"{each.name} : {type_of(each.type)}{initial_of(each)};" for each in section.variable)
        yield "\n".join((keyword + " CONSTANT" * section.constant, *lines, "END_VAR"))


def sections_of(interface: Any) -> Iterator[tuple[str, Any]]:
    """Yield what is declared, each with its keyword."""
    for keyword, sections in (
        ("VAR_INPUT", interface.input_vars),
        ("VAR_OUTPUT", interface.output_vars),
        ("VAR", interface.local_vars),
    ):
        for section in sections:
            yield keyword, section


def type_of(kind: Any) -> str:
    if kind.array is not None:
        bounds = ", ".join(f"{dimension.lower}..{dimension.upper}" for dimension in kind.array.dimension)
        return f"ARRAY[{bounds}] OF {type_of(kind.array.base_type)}"
    if kind.derived is not None:
        return str(kind.derived.name)
    (name,) = (name for field, name in ELEMENTARY.items() if getattr(kind, field) is not None)
    return name


def initial_of(variable: Any) -> str:
    given = variable.initial_value
    if given is None:
        return ""
    if given.simple_value is not None:
        return f" := {given.simple_value.value}"
    return f" := [{', '.join(each.simple_value.value for each in given.array_value.value)}]"
