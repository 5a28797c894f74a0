"""An inverter's EDS (CiA 306): data types, default values and PDO layouts of its objects.

The parser is ``canopen.objectdictionary``. It leaves a default it can't read as None without a word; here
that is an error as soon as the value is asked for.
"""

from __future__ import annotations

from configparser import Error as IniError
from pathlib import Path

from canopen.objectdictionary import ObjectDictionary, ObjectDictionaryError, import_od

from drivers.errors import ConfigMismatch
from drivers.pdo_map import PdoCodec, PdoLayout, read_layout
from drivers.resources import data_file
from drivers.scaling import IntegerType

_INTEGER_CODES = {kind.value for kind in IntegerType}

_MANDATORY_SECTION = "[DeviceInfo]"
"""Without it the library only warns, and everything it says about the device is missing."""

_PDO_NUMBERS = range(0x200)
"""Offsets of the up to 512 PDOs from 0x1400, 0x1600, 0x1800 and 0x1A00."""


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
        If the file is not there or is no EDS.
    """

    def __init__(self, path: Path | None, node_id: int) -> None:
        self.path = path or data_file("inverter.eds")
        self.node_id = node_id
        self.dictionary = _parse(self.path, node_id)

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
        """Find the PDO that maps all the objects ``indices``.

        Raises
        ------
        ConfigMismatch
            If no PDO of this EDS carries all of them.
        """
        layouts = self._layouts(communication_base, mapping_base)
        for layout in layouts:
            if set(indices) <= {mapped.index for mapped in layout.objects}:
                return layout
        wanted = ", ".join(f"0x{index:04X}" for index in indices)
        raise ConfigMismatch(
            f"EDS {self.path}: expected one PDO from 0x{communication_base:04X} on that maps {wanted}, found "
            f"{'; '.join(map(str, layouts)) or 'no PDO'}. Give the EDS a mapping that has them in one PDO."
        )

    def codec(self, layout: PdoLayout, where: str) -> PdoCodec:
        """Build packer and unpacker of a PDO's frames, with this EDS's data types."""
        return PdoCodec(layout, self.types(), where)

    def _layouts(self, communication_base: int, mapping_base: int) -> tuple[PdoLayout, ...]:
        return tuple(
            read_layout(self.default, communication_base + n, mapping_base + n)
            for n in _PDO_NUMBERS
            if self.has(communication_base + n) and self.has(mapping_base + n)
        )


def _parse(path: Path, node_id: int) -> ObjectDictionary:
    advice = "Expected an EDS as CiA 306 has it; take the file from the drive's maker."
    try:
        with path.open(encoding="latin-1") as file:
            if _MANDATORY_SECTION not in file.read():
                raise ConfigMismatch(f"EDS {path} has no section {_MANDATORY_SECTION}. {advice}")
            file.seek(0)
            dictionary = import_od(file, node_id)
    except OSError as error:
        raise ConfigMismatch(f"EDS {path} can't be read: {error.strerror}. {advice}") from error
    except (IniError, ObjectDictionaryError, ValueError, KeyError) as error:
        raise ConfigMismatch(f"EDS {path} can't be read: {error}. {advice}") from error
    if not len(dictionary):
        raise ConfigMismatch(f"EDS {path} lists no object. {advice}")
    return dictionary
