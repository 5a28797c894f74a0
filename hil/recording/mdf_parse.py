"""An open MDF file as a table: by its description where it has one, else as another program's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.recording.description import described_table, metadata_of
from hil.recording.kinds import Column, Kind, as_column
from hil.recording.mdf_file import channels_of, is_unfinished
from hil.recording.mdf_foreign import foreign_metadata, foreign_table, foreign_tables
from hil.recording.request import Request
from hil.recording.table import Table

if TYPE_CHECKING:
    from asammdf import MDF

DESCRIPTION = "recording.json"

FINALISED = "its writer never finished it: it was finalised in a copy and read from there, the file stays as it is"


def parse(path: Path, mdf: MDF, request: Request) -> Table:
    """Read a file's content."""
    text = _description(mdf)
    table = foreign_table(path, mdf, request) if text is None else _own(path, mdf, text)
    # The columns become plain arrays of their own, not views into the file.
    columns = {name: column.copy() for name, column in table.columns.items()}
    remarks = (*table.remarks, FINALISED) if is_unfinished(path) else table.remarks
    return replace(table, columns=columns, remarks=remarks)


def parse_all(path: Path, mdf: MDF, request: Request) -> list[Table]:
    """Read a file's content, a table for each of its times; see `parse`."""
    text = _description(mdf)
    return foreign_tables(path, mdf, request) if text is None else [_own(path, mdf, text)]


def parse_metadata(path: Path, mdf: MDF) -> Mapping[str, str]:
    """Read what a file says of itself."""
    text = _description(mdf)
    return foreign_metadata(mdf) if text is None else metadata_of(path, text)


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

    def column(stored_as: str, kind: Kind) -> Column:
        cells = as_column(mdf.get(group=0, index=places[stored_as]).samples)
        return cells.astype(np.bool_) if kind is Kind.BOOLEAN else cells

    return described_table(path, text, column)
