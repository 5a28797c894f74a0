"""An EDS's objects as the ``canopen`` library keeps them, for its SDO client and server.

Its own reader is not used: it gives up on a whole file for one blank PDOMapping, one capital letter in a
section's name or one octal number, and it says nothing of a default it can't read.
"""

from __future__ import annotations

from collections.abc import Mapping

from canopen.objectdictionary import ObjectDictionary, ODArray, ODRecord, ODVariable

from drivers.datasheet.number import read_number
from drivers.datasheet.objects import EdsEntry, EdsObject, ObjectType
from drivers.datasheet.text import EdsText
from drivers.datasheet.types import DATA_TYPES, DOMAIN, OCTET_STRING

DUMMY_TYPES = range(1, 8)
"""Data types that a PDO may carry as a filler, where ``[DummyUsage]`` allows it."""


def build_dictionary(text: EdsText, objects: Mapping[int, EdsObject], node_id: int) -> ObjectDictionary:
    """Build the library's object dictionary with ``$NODEID`` replaced; what has no known type is left out."""
    dictionary = ObjectDictionary()  # type: ignore[no-untyped-call]
    for described in objects.values():
        variables = [_variable(entry, node_id) for entry in described.entries.values() if entry.kind is not None]
        if described.object_type in (ObjectType.ARRAY, ObjectType.RECORD):
            dictionary.add_object(_group(described, variables))
        elif described.object_type in (ObjectType.VAR, ObjectType.DOMAIN) and variables:
            dictionary.add_object(variables[0])
    for code in _dummies(text):
        dictionary.add_object(_dummy(code))
    return dictionary


def _group(described: EdsObject, variables: list[ODVariable]) -> ODArray | ODRecord:
    name = described.section.get("ParameterName") or described.section.name
    kind = ODArray if described.object_type is ObjectType.ARRAY else ODRecord
    group = kind(name, described.index)
    for variable in variables:
        group.add_member(variable)
    return group


def _variable(entry: EdsEntry, node_id: int) -> ODVariable:
    if entry.kind is None:
        raise ValueError(f"[{entry.section.name}] has no data type; expected one, the caller leaves others out")
    variable = ODVariable(entry.name, entry.index, entry.subindex)
    variable.data_type = entry.kind.code
    variable.access_type = entry.access or "rw"
    variable.pdo_mappable = entry.mappable
    variable.default = _default(entry, node_id)  # type: ignore[assignment]
    variable.min = entry.limit("LowLimit", node_id)
    variable.max = entry.limit("HighLimit", node_id)
    return variable


def _default(entry: EdsEntry, node_id: int) -> int | float | str | bytes | None:
    if entry.kind is None or entry.value_text is None or entry.kind.is_integer:
        return entry.value(node_id)
    if entry.kind.is_real:
        return read_real(entry.value_text)
    if entry.kind.code in (OCTET_STRING, DOMAIN):
        return read_octets(entry.value_text)
    return entry.value_text


def read_real(text: str) -> float | None:
    """Read a floating-point number; None if it is none."""
    try:
        return float(text)
    except ValueError:
        return None


def read_octets(text: str) -> bytes | None:
    """Read bytes written as pairs of hexadecimal digits; None if they are none."""
    try:
        return bytes.fromhex(text)
    except ValueError:
        return None


def _dummies(text: EdsText) -> list[int]:
    section = text.section("DummyUsage")
    if section is None:
        return []
    return [code for code in DUMMY_TYPES if read_number(section.get(f"Dummy{code:04d}") or "0")]


def _dummy(code: int) -> ODVariable:
    variable = ODVariable(DATA_TYPES[code].name, code)
    variable.data_type = code
    variable.access_type = "const"
    return variable
