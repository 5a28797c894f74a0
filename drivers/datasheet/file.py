"""A drive's EDS or DCF (CiA 306) as the drivers use it: data types, values and PDO codecs of its objects.

The chain is `drivers.datasheet.text` (lines), `objects` (objects), and here `build_dictionary` (the ``canopen``
library's own form) and `DataSheet` (what is asked for, by index and sub-index). What a file has wrong is an error as
soon as it is asked for; `drivers.eds_check` says it all beforehand.

The library's own reader is not used: it gives up on a whole file for one blank PDOMapping, one capital letter in a
section's name or one octal number, and it says nothing of a default it can't read.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from canopen.objectdictionary import ObjectDictionary, ODArray, ODRecord, ODVariable

from drivers.canopen.pdo_map import PdoCodec, PdoLayout
from drivers.datasheet.objects import EdsEntry, EdsObject, ObjectType, objects_of_use, read_objects
from drivers.datasheet.text import NO_EDS, EdsText, Severity, read_eds_text
from drivers.datasheet.types import DATA_TYPES, DOMAIN, OCTET_STRING, read_number
from drivers.errors import ConfigMismatch
from drivers.resources import data_file
from drivers.scaling import IntegerType

NODE_IDS: Final = range(1, 128)
BIT_RATES_KBIT_S: Final = range(10, 1001)

DUMMY_TYPES = range(1, 8)  # data types that a PDO may carry as a filler, where ``[DummyUsage]`` allows it

_INTEGER_CODES = {kind.value for kind in IntegerType}

_MANDATORY_SECTION = "DeviceInfo"  # without it, it is another kind of file


@dataclass(frozen=True, slots=True)
class Commissioning:
    """What a DCF says of the node it was written for (CiA 306, ``[DeviceComissioning]``)."""

    node_id: int | None = None  # its node id
    bit_rate_kbit_s: int | None = None  # bit rate of its bus [kbit/s]; None if it says none from 10 to 1000


@dataclass(frozen=True, slots=True)
class DataSheet:
    """One file, for one node."""

    path: Path  # the file
    objects: Mapping[int, EdsObject]  # its objects
    node_id: int  # what ``$NODEID`` stands for
    commissioning: Commissioning | None = None  # of a DCF; None of an EDS

    @property
    def kind(self) -> str:
        """What kind of file it is, in messages."""
        return "EDS" if self.commissioning is None else "DCF"

    @property
    def commissioned_node(self) -> int | None:
        """Node id that the file was written for; None if it is for any."""
        return None if self.commissioning is None else self.commissioning.node_id

    def entry(self, index: int, subindex: int = 0) -> EdsEntry | None:
        """Look up one value of the object dictionary."""
        found = self.objects.get(index)
        return None if found is None else found.entries.get(subindex)

    def value(self, index: int, subindex: int = 0) -> int | None:
        """Value of an integer as the file has it; None if it lists none that can be read."""
        entry = self.entry(index, subindex)
        return None if entry is None else entry.value(self.node_id)

    def commissioned(self, index: int, subindex: int = 0) -> int | None:
        """Value that somebody gave the device, by a DCF; None if it has none."""
        entry = self.entry(index, subindex)
        return None if entry is None or entry.parameter_text is None else entry.value(self.node_id)


def read_commissioning(text: EdsText) -> Commissioning | None:
    """Read what a DCF says of its node; None for an EDS."""
    if not text.is_dcf:
        return None
    section = text.commissioning
    if section is None:
        return Commissioning()
    node_id, rate = (read_number(section.get(key) or "") for key in ("NodeID", "Baudrate"))
    return Commissioning(
        node_id=node_id if node_id in NODE_IDS else None, bit_rate_kbit_s=rate if rate in BIT_RATES_KBIT_S else None
    )


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
    """Read a decimal number; None for what is none."""
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


class EdsFile:
    """One EDS, with ``$NODEID`` replaced by the node's id."""

    def __init__(self, path: Path | None, node_id: int) -> None:
        self.path = path or data_file("inverter.eds")
        self.node_id = node_id
        text = _readable(read_eds_text(self.path))
        objects = objects_of_use(read_objects(text))
        self.sheet = DataSheet(self.path, objects, node_id, read_commissioning(text))
        self.dictionary: ObjectDictionary = build_dictionary(text, objects, node_id)
        if not len(self.dictionary):
            raise ConfigMismatch(f"EDS {text.path} lists no object. {NO_EDS}")

    def integer_type(self, index: int, subindex: int = 0) -> IntegerType:
        """Look up the data type of an integer object."""
        code = getattr(self.dictionary.get_variable(index, subindex), "data_type", None)
        if code not in _INTEGER_CODES:
            got = "no such object" if code is None else f"data type 0x{code:04X}"
            raise ConfigMismatch(
                f"EDS {self.path}: expected an integer object 0x{index:04X}:{subindex:02X}, found {got}. "
                "Use the EDS of the drive's firmware version."
            )
        return IntegerType(code)

    def types(self) -> dict[tuple[int, int], IntegerType]:
        """List the data types of all integer objects, by ``(index, subindex)``."""
        found = {}
        for index, entry in self.dictionary.items():
            for variable in getattr(entry, "values", lambda entry=entry: (entry,))():
                if variable.data_type in _INTEGER_CODES:
                    found[index, variable.subindex] = IntegerType(variable.data_type)
        return found

    def codec(self, layout: PdoLayout, where: str) -> PdoCodec:
        """Build packer and unpacker of a PDO's frames, with this EDS's data types."""
        return PdoCodec(layout, self.types(), where)


def _readable(text: EdsText) -> EdsText:
    if text.section(_MANDATORY_SECTION) is None:
        raise ConfigMismatch(f"EDS {text.path} has no section [{_MANDATORY_SECTION}]. {NO_EDS}")
    for finding in text.findings:
        if finding.severity is Severity.ERROR:
            raise ConfigMismatch(f"EDS {text.path} can't be read: line {finding.line}, {finding}")
    return text
