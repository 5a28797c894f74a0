"""What the frames of a logged CAN bus mean: a DBC file, or the EDS or DCF of its drives.

An EDS has the PDOs as they are mapped where nobody maps them otherwise, for whatever node id: a frame is that of the
node whose identifier it has, and its signals end in the node's id. Torques are per mille of the rated torque (0x6076),
speeds in the unit of 0x60A9 (CiA 402); where the file has no value of these, they are given as they are sent.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from drivers.canopen.pdo_map import TPDO_COMMUNICATION, TPDO_MAPPING, PdoLayout, read_layout
from drivers.capability.speed_unit import DIMENSION_INDEX, NOTATION_INDEX, SI_UNIT_VELOCITY, scale_of
from drivers.datasheet.file import DataSheet, EdsFile
from drivers.errors import DriverError
from drivers.foreign_file import require_regular
from hil.errors import RecordingError

LARGEST_BYTES: Final = 32 << 20  # a DBC file of a whole vehicle has some megabytes

DATA_SHEETS: Final = (".eds", ".dcf")
MOST_PDOS: Final = 512
NODES: Final = range(1, 128)

RATED_TORQUE: Final = 0x6076
TORQUES: Final = (0x6071, 0x6074, 0x6077)
SPEEDS: Final = (0x606B, 0x606C, 0x60FF)


def database_of(path: Path, dbc: Path) -> Any:
    """Read a file that says what the frames of a log mean, as a database of cantools."""
    import cantools

    if dbc.suffix.lower() not in (".dbc", *DATA_SHEETS):
        raise RecordingError(path, f"--dbc {dbc}: expected a DBC file (.dbc), an EDS or a DCF, got {dbc.suffix!r}")
    kind = "DBC file" if dbc.suffix.lower() == ".dbc" else "data sheet"
    try:
        if require_regular(dbc).st_size > LARGEST_BYTES:
            raise ValueError(f"more than {LARGEST_BYTES >> 20} MB")
        if kind == "DBC file":
            database: Any = cantools.database.load_file(dbc, "dbc")
        else:
            database = cantools.database.can.Database([*_messages(dbc)])
    except Exception as error:
        raise RecordingError(path, f"--dbc {dbc}: expected a {kind}, got: {type(error).__name__}: {error}") from error
    if not database.messages:
        raise RecordingError(path, f"--dbc {dbc}: expected a {kind} that describes messages, got one without any")
    return database


def _messages(path: Path) -> Iterator[Any]:
    """Yield the TPDOs of an EDS for every node id, of a DCF for its own."""
    sheet = EdsFile(path, NODES[0]).sheet
    own = sheet.commissioned_node
    seen: set[int] = set()
    for node in NODES if own is None else (own,):
        of_node = DataSheet(sheet.path, sheet.objects, node, sheet.commissioning)
        for layout in _layouts(of_node):
            if layout.cob_id not in seen and layout.objects and layout.valid and not layout.extended:
                seen.add(layout.cob_id)
                yield _message(of_node, layout)


def _layouts(sheet: DataSheet) -> Iterator[PdoLayout]:
    def read(index: int, subindex: int) -> int:
        value = sheet.value(index, subindex)
        if value is None:
            raise KeyError(index, subindex)
        return value

    for number in range(MOST_PDOS):
        if sheet.entry(TPDO_COMMUNICATION + number, 1) is not None:
            try:
                yield read_layout(read, TPDO_COMMUNICATION + number, TPDO_MAPPING + number)
            except (KeyError, DriverError):
                continue  # a PDO whose mapping the file leaves open


def _message(sheet: DataSheet, layout: PdoLayout) -> Any:
    from cantools.database.can import Message, Signal
    from cantools.database.conversion import BaseConversion

    signals, start = [], 0
    for mapped in layout.objects:
        entry = sheet.entry(mapped.index, mapped.subindex)
        name = "" if entry is None else re.sub(r"\W+", "_", entry.name).strip("_")
        kind = None if entry is None else entry.kind
        scale, unit = _si(sheet, mapped.index)
        signals.append(
            Signal(
                f"{name or f'object_{mapped.index:04X}_{mapped.subindex:02X}'}_{sheet.node_id}",
                start,
                mapped.length_bits,
                is_signed=kind is not None and kind.signed,
                conversion=BaseConversion.factory(scale=scale, is_float=kind is not None and kind.is_real),
                unit=unit,
            )
        )
        start += mapped.length_bits
    name = f"TPDO_{layout.communication_index - TPDO_COMMUNICATION + 1}_{sheet.node_id}"
    return Message(layout.cob_id, name, -(-start // 8), signals)


def _si(sheet: DataSheet, index: int) -> tuple[float, str]:
    """Return factor and unit of an object: of torque and speed SI, where the file has what it takes."""
    if index in TORQUES:
        rated_mnm = sheet.value(RATED_TORQUE)
        return (rated_mnm * 1e-6, "Nm") if rated_mnm else (1.0, "permille")
    if index in SPEEDS:
        units = {each: sheet.value(each) for each in (SI_UNIT_VELOCITY, NOTATION_INDEX, DIMENSION_INDEX)}
        scale = scale_of(units, str(sheet.path))
        return (1.0, "") if scale is None else (scale.rad_s_per_count, "rad/s")
    return 1.0, ""
