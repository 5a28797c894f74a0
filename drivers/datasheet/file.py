"""An inverter's EDS (CiA 306) as the drivers use it: data types, default values and PDO layouts of its objects.

The chain is `eds_text` (lines), `eds_objects` (objects), `eds_dictionary` (the ``canopen`` library's own form).
What a file has wrong is an error as soon as it is asked for; `drivers.datasheet.check` tells it all beforehand.
"""

from __future__ import annotations

from pathlib import Path

from canopen.objectdictionary import ObjectDictionary

from drivers.canopen.pdo_map import PdoCodec, PdoLayout
from drivers.datasheet.dictionary import build_dictionary
from drivers.datasheet.finding import Severity
from drivers.datasheet.objects import read_objects
from drivers.datasheet.pdo import find_pdo
from drivers.datasheet.text import NO_EDS, EdsText, read_eds_text
from drivers.errors import ConfigMismatch
from drivers.resources import data_file
from drivers.scaling import IntegerType

_INTEGER_CODES = {kind.value for kind in IntegerType}

_MANDATORY_SECTION = "DeviceInfo"
"""Without it, it is another kind of file."""


class EdsFile:
    """One EDS, with ``$NODEID`` replaced by the node's id.

    Parameters
    ----------
    path
        The file; None for the EDS that is shipped.
    node_id
        Node id, 1 to 127.

    Raises
    ------
    ConfigMismatch
        If the file is not there, is no EDS, or has two values for one key.
    """

    def __init__(self, path: Path | None, node_id: int) -> None:
        self.path = path or data_file("inverter.eds")
        self.node_id = node_id
        self.dictionary = _parse(read_eds_text(self.path), node_id)

    def integer_type(self, index: int, subindex: int = 0) -> IntegerType:
        """Look up the data type of an integer object.

        Raises
        ------
        ConfigMismatch
            If the EDS has no such object, or it is no integer of 8, 16 or 32 bit.
        """
        code = getattr(self.dictionary.get_variable(index, subindex), "data_type", None)
        if code not in _INTEGER_CODES:
            came = "no such object" if code is None else f"data type 0x{code:04X}"
            raise ConfigMismatch(
                f"EDS {self.path}: expected an integer object 0x{index:04X}:{subindex:02X}, found {came}. "
                "Use the EDS of the drive's firmware version."
            )
        return IntegerType(code)

    def default(self, index: int, subindex: int = 0) -> int:
        """Look up the default value of an integer object.

        Raises
        ------
        ConfigMismatch
            If the EDS has no such object, or no readable default for it.
        """
        self.integer_type(index, subindex)
        value = getattr(self.dictionary.get_variable(index, subindex), "default", None)
        if not isinstance(value, int):
            raise ConfigMismatch(
                f"EDS {self.path}: object 0x{index:04X}:{subindex:02X} has no readable DefaultValue, "
                "expected a number. Add it to the EDS."
            )
        return value

    def has_default(self, index: int, subindex: int = 0) -> bool:
        """Whether the EDS gives the object a default value that can be read; makers leave many blank."""
        return isinstance(getattr(self.dictionary.get_variable(index, subindex), "default", None), int)

    def has(self, index: int) -> bool:
        """Whether the EDS lists the object."""
        return index in self.dictionary

    def types(self) -> dict[tuple[int, int], IntegerType]:
        """List the data types of all integer objects, by ``(index, subindex)``."""
        found = {}
        for index, entry in self.dictionary.items():
            for variable in getattr(entry, "values", lambda entry=entry: (entry,))():
                if variable.data_type in _INTEGER_CODES:
                    found[index, variable.subindex] = IntegerType(variable.data_type)
        return found

    def pdo_carrying(self, communication_base: int, mapping_base: int, *indices: int) -> PdoLayout:
        """Find the first PDO that maps all the objects ``indices``.

        Raises
        ------
        ConfigMismatch
            If no PDO of this EDS carries all of them.
        """
        search = find_pdo(self.has, self.default, (communication_base, mapping_base), indices)
        if search.layout is not None:
            return search.layout
        wanted = ", ".join(f"0x{index:04X}" for index in indices)
        raise ConfigMismatch(
            f"EDS {self.path}: expected one PDO from 0x{communication_base:04X} on that maps {wanted}, found "
            f"{'; '.join(search.others) or 'no PDO'}. Give the EDS a mapping that has them in one PDO."
        )

    def codec(self, layout: PdoLayout, where: str) -> PdoCodec:
        """Build packer and unpacker of a PDO's frames, with this EDS's data types."""
        return PdoCodec(layout, self.types(), where)


def _parse(text: EdsText, node_id: int) -> ObjectDictionary:
    if text.section(_MANDATORY_SECTION) is None:
        raise ConfigMismatch(f"EDS {text.path} has no section [{_MANDATORY_SECTION}]. {NO_EDS}")
    for finding in text.findings:
        if finding.severity is Severity.ERROR:
            raise ConfigMismatch(f"EDS {text.path} can't be read: line {finding.line}, {finding}")
    dictionary = build_dictionary(text, read_objects(text), node_id)
    if not len(dictionary):
        raise ConfigMismatch(f"EDS {text.path} lists no object. {NO_EDS}")
    return dictionary
