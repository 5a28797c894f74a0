"""A drive's EDS or DCF (CiA 306) as the drivers use it: data types, values and PDO codecs of its objects.

The chain is `drivers.datasheet.text` (lines), `objects` (objects), `dictionary` (the ``canopen`` library's own form)
and `sheet` (what is asked for). What a file has wrong is an error as soon as it is asked for; `drivers.eds_check`
says it all beforehand.
"""

from __future__ import annotations

from pathlib import Path

from canopen.objectdictionary import ObjectDictionary

from drivers.canopen.pdo_map import PdoCodec, PdoLayout
from drivers.datasheet.dictionary import build_dictionary
from drivers.datasheet.finding import Severity
from drivers.datasheet.objects import objects_of_use, read_objects
from drivers.datasheet.sheet import DataSheet, read_commissioning
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

    Attributes
    ----------
    path, node_id
        As given.
    sheet
        Its objects, to be asked for.
    dictionary
        Its objects, as the ``canopen`` library keeps them.

    Raises
    ------
    ConfigMismatch
        If the file is not there, is no EDS, or has two values for one key.
    """

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
