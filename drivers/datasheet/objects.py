"""The objects an EDS describes: sections ``[1018]``, ``[1018sub1]`` and ``[1018Name]`` put together.

In a device configuration file (DCF) a ParameterValue counts before the DefaultValue. In an EDS it says nothing: there
it is left over from somebody's tool.

Read with the tolerance that vendors' files need: a missing ObjectType is VAR (CiA 306), or RECORD where
there are sub-indices; a blank PDOMapping is 0; ``CompactSubObj`` is written out. What is wrong is for
`drivers.eds_check` to tell; here it is None, and whoever needs it refuses.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum

from drivers.datasheet.text import EdsSection, EdsText
from drivers.datasheet.types import DATA_TYPES, DOMAIN, UNSIGNED8, DataType, read_formula, read_number

_PDO_PARAMETERS = range(0x1400, 0x1C00)
_OTHER_PARAMETER = 0x200  # bit by which the indices of communication and mapping parameter differ

OBJECT_SECTION = re.compile(r"[0-9a-f]{4}")
SUB_SECTION = re.compile(r"([0-9a-f]{4})sub([0-9a-f]{1,2})")

COB_ID_MASK = 0x7FF  # bits of an identifier; above them are switches

ACCESS_TYPES = ("ro", "wo", "rw", "rwr", "rww", "const")
"""CiA 306: rwr may be mapped into a TPDO only, rww into an RPDO only."""


class ObjectType(IntEnum):
    """What an object is, CiA 301 table 42."""

    NULL = 0
    DOMAIN = 2
    DEFTYPE = 5
    DEFSTRUCT = 6
    VAR = 7
    ARRAY = 8
    RECORD = 9

    @property
    def has_entries(self) -> bool:
        """Whether its values are in entries from subindex 1 on."""
        return self in (ObjectType.ARRAY, ObjectType.RECORD)


_WITH_VALUES = (ObjectType.VAR, ObjectType.DOMAIN, ObjectType.ARRAY, ObjectType.RECORD)


@dataclass(frozen=True, slots=True)
class EdsEntry:
    """One value of the object dictionary."""

    index: int  # of the object, 0x1000 to 0xFFFF
    subindex: int  # in it; 0 for an object of one value
    section: EdsSection  # the section that describes it
    name: str  # parameterName, or the section's name without one
    kind: DataType | None  # data type
    access: str | None  # one of `ACCESS_TYPES`
    mappable: bool  # whether a PDO may carry it
    default_text: str | None  # defaultValue as written
    parameter_text: str | None = None  # parameterValue as written in a DCF; None if missing or blank, and in an EDS

    @property
    def value_text(self) -> str | None:
        """Value as written that counts."""
        return self.default_text if self.parameter_text is None else self.parameter_text

    @property
    def value_key(self) -> str:
        """Key of the value that counts."""
        return "DefaultValue" if self.parameter_text is None else "ParameterValue"

    @property
    def writable(self) -> bool:
        """Whether it may be written by SDO."""
        return self.access is not None and "w" in self.access

    @property
    def readable(self) -> bool:
        """Whether it can be read by SDO."""
        return self.access is not None and self.access != "wo"

    @property
    def settable(self) -> bool:
        """Whether it may be written and read back."""
        return self.writable and self.readable

    @property
    def node_relative(self) -> bool:
        """Whether its value is given by the node id."""
        formula = read_formula(self.value_text or "")
        return formula is not None and formula.of_node_id

    def value(self, node_id: int) -> int | None:
        """Value of an integer as the file has it; None if there is none that can be read and fits."""
        return self._integer(self.value_text, node_id)

    def limit(self, key: str, node_id: int) -> int | None:
        """``LowLimit`` or ``HighLimit`` of an integer; None if there is none that can be read and fits."""
        return self._integer(self.section.get(key), node_id)

    def _integer(self, text: str | None, node_id: int) -> int | None:
        if text is None or self.kind is None or not self.kind.is_integer:
            return None
        return self.kind.integer(text, node_id)


@dataclass(frozen=True, slots=True)
class EdsObject:
    """One object: a variable has its one value as entry 0."""

    index: int  # 0x1000 to 0xFFFF
    section: EdsSection  # of the file
    object_type: ObjectType | None  # by CiA 306; None where the file does not say
    entries: Mapping[int, EdsEntry]  # by subindex


def read_objects(text: EdsText) -> dict[int, EdsObject]:
    """Read all objects, in the order of their index."""
    names = sorted(name for name in text.sections if OBJECT_SECTION.fullmatch(name))
    subs = sub_sections(text)
    return {int(name, 16): _object(text, name, subs.get(int(name, 16), {})) for name in names}


def objects_of_use(objects: Mapping[int, EdsObject]) -> dict[int, EdsObject]:
    """Leave out objects without any value, and a PDO's communication or mapping parameter without the other.

    The ``canopen`` library looks for the second wherever the first is.
    """
    there = {index: each for index, each in objects.items() if each.entries}
    return {
        index: each
        for index, each in there.items()
        if index not in _PDO_PARAMETERS or index ^ _OTHER_PARAMETER in there
    }


def sub_sections(text: EdsText) -> dict[int, dict[int, EdsSection]]:
    """Find the sections of sub-indices, by index and sub-index, whether their object is described or not."""
    found: dict[int, dict[int, EdsSection]] = {}
    for name, section in text.sections.items():
        match = SUB_SECTION.fullmatch(name)
        if match is not None:
            found.setdefault(int(match[1], 16), {})[int(match[2], 16)] = section
    return found


def object_type(section: EdsSection, has_entries: bool) -> ObjectType | None:
    """Read what an object is; None if ObjectType is none of CiA 301."""
    written = section.get("ObjectType")
    if written is None:
        return ObjectType.RECORD if has_entries else ObjectType.VAR
    number = read_number(written)
    return ObjectType(number) if number in list(ObjectType) else None


def data_type(text: EdsText, section: EdsSection) -> DataType | None:
    """Read a data type; None if it is missing or unknown.

    CANFestival's editor describes types with limits as objects ``[A0]`` whose sub-index 1 holds the real type.
    """
    code = read_number(section.get("DataType") or "")
    if code is None or code in DATA_TYPES:
        return None if code is None else DATA_TYPES[code]
    described = text.section(f"{code:x}sub1")
    real = None if described is None else read_number(described.get("DefaultValue") or "")
    return None if real is None else DATA_TYPES.get(real)


def _object(text: EdsText, name: str, subs: Mapping[int, EdsSection]) -> EdsObject:
    section = text.sections[name]
    index = int(name, 16)
    compact = read_number(section.get("CompactSubObj") or "") or 0
    kind = object_type(section, bool(subs) or compact > 0)
    if kind not in _WITH_VALUES:  # a definition of a type, or nobody knows what: it has no value to be asked for
        entries = {}
    elif kind not in (ObjectType.ARRAY, ObjectType.RECORD):
        entries = {0: _entry(text, section, index, 0)}
    else:
        entries = {n: _entry(text, sub, index, n) for n, sub in subs.items()}
        if compact:
            entries = {**dict(_compact_entries(text, section, index, min(compact, 0xFE))), **entries}
    return EdsObject(index, section, kind, dict(sorted(entries.items())))


def _entry(text: EdsText, section: EdsSection, index: int, subindex: int) -> EdsEntry:
    kind = data_type(text, section)
    if kind is None and object_type(section, has_entries=False) is ObjectType.DOMAIN:
        kind = DATA_TYPES[DOMAIN]
    access = (section.get("AccessType") or "").lower()
    return EdsEntry(
        index=index,
        subindex=subindex,
        section=section,
        name=section.get("ParameterName") or section.name,
        kind=kind,
        access=access if access in ACCESS_TYPES else None,
        mappable=bool(read_number(section.get("PDOMapping") or "0")),
        default_text=section.get("DefaultValue"),
        parameter_text=_parameter_text(text, section),
    )


def _parameter_text(text: EdsText, section: EdsSection) -> str | None:
    """Read the ParameterValue of a DCF; what it is by the node id it is for every node, as its DefaultValue says."""
    written = section.get("ParameterValue") if text.is_dcf else None
    default = read_formula(section.get("DefaultValue") or "")
    value = None if written is None else read_formula(written)
    node_id = None if text.commissioning is None else read_number(text.commissioning.get("NodeID") or "")
    if default is None or value is None or not default.of_node_id or value.of_node_id or node_id is None:
        return written
    constant = value.constant - node_id
    same = not (constant ^ default.constant) & COB_ID_MASK
    return f"$NODEID+0x{constant:X}" if same and constant >= 0 else written


def _compact_entries(text: EdsText, section: EdsSection, index: int, count: int) -> Iterator[tuple[int, EdsEntry]]:
    """Write out what ``CompactSubObj`` stands for (CiA 306): the number of entries, and as many alike."""
    names = text.section(f"{section.name}Name")
    values = text.section(f"{section.name}Value") if text.is_dcf else None
    unsigned8 = DATA_TYPES[UNSIGNED8]
    yield 0, EdsEntry(index, 0, section, "NrOfObjects", unsigned8, "ro", mappable=False, default_text=str(count))
    alike = _entry(text, section, index, 0)
    for n in range(1, count + 1):
        name = (None if names is None else names.get(str(n))) or f"{alike.name}{n}"
        parameter = None if values is None else values.get(str(n))
        yield n, replace(alike, subindex=n, name=name, parameter_text=parameter)
