"""MDF 4.10 (ASAM MDF), as measurement tools read it: one group, its time as master channel, units and comments.

The group is timed by ``time_s``, the master channel, where that can be one (finite and increasing: ASAM MDF 4.1,
5.18); else by the number of the row. What a run says of itself is in the file's comment as common properties, for
people; its rig file is attached as ``rig.toml``; ``recording.json``, attached too, is what is read back
(`hil.recording.description`), for MDF's texts are cut free of blanks and its names take no backslash.

Versions 3 and 4 of other programs are read too, by `hil.recording.mdf_file`.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.recording import columns
from hil.recording.checksum import RIG_TEXT
from hil.recording.description import described_table, description_of, metadata_of
from hil.recording.mdf_file import channels_of, foreign_metadata, foreign_table, foreign_tables, is_unfinished, opened
from hil.recording.request import Request
from hil.recording.table import Column, ColumnKind, Table, as_column
from hil.version import __version__

if TYPE_CHECKING:
    from asammdf import MDF, Signal


DESCRIPTION = "recording.json"

FINALISED = "its writer never finished it: it was finalised in a copy and read from there, the file stays as it is"

VERSION = "4.10"
RIG_NAME = "rig.toml"
ROW_NUMBER = "row"

TIME_MASTER, INDEX_MASTER = 1, 4  # kinds of master channel, ``cn_sync_type`` (ASAM MDF 4.1, table 59)

LONGEST_PROPERTY = 200
"""Characters of a value that still stands in the file's comment; longer ones are in the attachments only."""


def _description(mdf: MDF) -> str | None:
    if mdf.version < "4":  # such files have no attachments, and asammdf refuses to say so
        return None
    for number, attachment in enumerate(mdf.attachments):
        if str(attachment.file_name) == DESCRIPTION:
            content: Any = mdf.extract_attachment(number)[0]
            return content if isinstance(content, str) else bytes(content).decode("utf-8")
    return None


def _own(path: Path, mdf: MDF, text: str) -> Table:
    places = {channel.name: number for number, channel in enumerate(channels_of(mdf, 0))}

    def column(stored_as: str, kind: ColumnKind) -> Column:
        cells = as_column(mdf.get(group=0, index=places[stored_as]).samples)
        return cells.astype(np.bool_) if kind is ColumnKind.BOOLEAN else cells

    return described_table(path, text, column)


def read(path: Path, request: Request) -> Table:
    """Read an MDF recording: one of this program whole, of another the channels of one time."""
    with opened(path) as mdf:
        text = _description(mdf)
        table = foreign_table(path, mdf, request) if text is None else _own(path, mdf, text)
        # The columns become plain arrays of their own, not views into the file.
        columns = {name: column.copy() for name, column in table.columns.items()}
        remarks = (*table.remarks, FINALISED) if is_unfinished(path) else table.remarks
        return replace(table, columns=columns, remarks=remarks)


def read_all(path: Path, request: Request) -> list[Table]:
    """Read an MDF recording, a table for each of its times."""
    with opened(path) as mdf:
        text = _description(mdf)
        return foreign_tables(path, mdf, request) if text is None else [_own(path, mdf, text)]


def read_metadata(path: Path) -> Mapping[str, str]:
    """Read what an MDF recording says of itself."""
    with opened(path) as mdf:
        text = _description(mdf)
        return foreign_metadata(mdf) if text is None else metadata_of(path, text)


def write(table: Table, path: Path) -> None:
    """Write a table as MDF 4 with the recording's time as master; without a usable one, with row numbers."""
    from asammdf import MDF

    stored_as = {name: _channel_name(number, name) for number, name in enumerate(table.columns)}
    master = columns.TIME if _can_be_master(table.columns.get(columns.TIME)) else None
    row_numbers = np.arange(table.n_rows, dtype=np.float64)
    times = row_numbers if master is None else table.columns[master]
    metadata = (ROW_NUMBER, INDEX_MASTER) if master is None else (master, TIME_MASTER)
    signals = [_signal(table, name, stored_as[name], times, metadata) for name in table.columns if name != master]
    content = io.BytesIO()
    with MDF(version=VERSION) as mdf:
        # A master channel alone is no group for asammdf: then the row's number goes with it.
        mdf.append(
            signals or [_numbers(row_numbers, times, metadata)],
            "hil",
            comment=_plain(_metadata_of(table, "experiment")),
        )
        _describe(mdf, table)
        mdf.attach(description_of(table, stored_as).encode(), DESCRIPTION, mime="application/json")
        if rig := _metadata_of(table, RIG_TEXT):
            mdf.attach(rig.encode("utf-8"), RIG_NAME, comment="rig file of the run", mime="text/plain")
        mdf.save(content)
    path.write_bytes(content.getvalue())


def _channel_name(number: int, name: str) -> str:
    """Name a channel: like the column, where MDF takes that (a backslash ends a name, blanks around it are cut)."""
    return name if name.isprintable() and "\\" not in name and name.strip() == name else f"column {number + 1}"


def _can_be_master(column: Column | None) -> bool:
    if column is None or ColumnKind.of(column) is not ColumnKind.FLOAT:
        return False
    return bool(np.isfinite(column).all() and (np.diff(column) > 0).all())


def _signal(table: Table, name: str, stored_as: str, times: Column, master: tuple[str, int]) -> Signal:
    from asammdf import Signal

    column, kind = table.columns[name], ColumnKind.of(table.columns[name])
    samples = np.char.encode(column.astype(str), "utf-8") if kind is ColumnKind.TEXT else column
    return Signal(
        samples=samples.astype(np.uint8) if kind is ColumnKind.BOOLEAN else samples,
        timestamps=times,
        name=stored_as,
        unit=_plain(table.units.get(name, "")),
        comment=columns.COMMENTS.get(name, ""),
        encoding="utf-8" if kind is ColumnKind.TEXT else None,
        master_metadata=master,
    )


def _numbers(row_numbers: Column, times: Column, master: tuple[str, int]) -> Signal:
    from asammdf import Signal

    return Signal(samples=row_numbers, timestamps=times, name=ROW_NUMBER, master_metadata=master)


def _describe(mdf: MDF, table: Table) -> None:
    header: Any = mdf.header
    header.description = _plain(f"{table.path.stem}: written by hil {__version__}")
    header.author, header.subject = "hil", _plain(_metadata_of(table, "experiment"))
    started = _metadata_of(table, "started_utc")
    try:
        header.start_time = datetime.fromisoformat(started)
    except ValueError:  # it does not say when: the file is as old as the epoch, rather than as its conversion
        header.start_time = datetime.fromisoformat("1970-01-01T00:00:00+00:00")
    properties = header._common_properties  # noqa: SLF001 - asammdf has no other way to them
    for key, value in table.metadata.items():
        if len(value) <= LONGEST_PROPERTY and _plain(key + value):
            properties.setdefault(key, value)


def _plain(text: str) -> str:
    """Return a text that XML takes; empty where it does not, for it stands in the description all the same."""
    return text if text.isprintable() else ""


def _metadata_of(table: Table, key: str) -> str:
    return table.metadata.get(key, "")
