"""HDF5: ``/columns/<name>`` with an attribute ``unit`` each, and ``/recording_json`` (`hil.recording.description`).

Every dataset of numbers carries Fletcher's checksum of each of its chunks, which HDF5 itself verifies. Of another
program's file the vectors of numbers or texts, wherever they are, and the fields of tables are the columns, by their
path.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from hil.errors import RecordingError
from hil.recording.bounds import damaged, require_cells
from hil.recording.description import SCHEMA, described_table, description_of, metadata_of
from hil.recording.request import Request, under_names, vectors_of
from hil.recording.table import Column, ColumnKind, Table, as_column, columns_of_shared_length, is_column

CELL_BYTES = 8  # of the widest number; a longer element, such as a table's row, counts as several cells

DAMAGED = (OSError, KeyError, ValueError, TypeError, RuntimeError, IndexError, AttributeError)
"""What h5py raises on a file that is cut or damaged."""

PICKLED_TEXT = re.compile(r"(?:^|\n)a?V([^\n]*)\n")
"""A text in a pickle of protocol 0, read as what it is: nothing is unpickled."""

DESCRIPTION = "recording_json"
COLUMNS = "columns"


@contextmanager
def reading(path: Path, what: str) -> Iterator[Any]:
    """Open a file for reading."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            _require_self_contained(path, file)
            yield file
    except DAMAGED as error:
        raise damaged(path, f"a whole {what} file", error) from error


def _require_self_contained(path: Path, file: Any) -> None:
    """Refuse a file whose content is in others, and one that claims more cells than its size allows.

    Whoever opens a recording would read whatever file, pipe or device its maker has named.
    """
    import h5py

    cells = 0
    seen = set()

    def look(name: bytes, link: Any) -> bytes | None:
        """Return the name, which ends the visit, where the content is in another file."""
        nonlocal cells
        if link.type == h5py.h5l.TYPE_EXTERNAL:
            return name
        if link.type != h5py.h5l.TYPE_HARD:
            return None
        entry = h5py.h5o.open(file.id, name)
        if not isinstance(entry, h5py.h5d.DatasetID) or (address := h5py.h5o.get_info(entry).addr) in seen:
            return None
        seen.add(address)
        cells += math.prod(entry.shape) * max(1, entry.get_type().get_size() // CELL_BYTES)
        layout = entry.get_create_plist()
        return name if layout.get_layout() == h5py.h5d.VIRTUAL or layout.get_external_count() else None

    outside = file.id.links.visit(look, info=True)
    if outside is not None:
        raise RecordingError(
            path, f"{text_of(outside)}: expected data in this file, got a reference to another file. Copy it in."
        )
    require_cells(path, cells)


def text_of(name: bytes | str) -> str:
    """Return a name as text, whatever bytes it is made of."""
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else name


def write_whole(path: Path, fill: Callable[[Any], None], header: bytes = b"") -> None:
    """Write a file; it is made in memory, so that a full disk is reported by Python, in words, and not by HDF5."""
    import h5py

    content = io.BytesIO()
    with h5py.File(content, "w", userblock_size=512 if header else 0) as file:
        fill(file)
    content.seek(0)
    content.write(header)
    path.write_bytes(content.getbuffer())


File: TypeAlias = Any
Dataset: TypeAlias = Any  # those of h5py, which has no types


def read(path: Path, request: Request) -> Table:
    """Read an HDF5 recording: one of this program whole, of another the channels asked for."""
    with reading(path, "HDF5") as file:
        return _own(path, file) if _is_own(file) else _foreign(path, file, request)


def read_metadata(path: Path) -> dict[str, str]:
    """Read what an HDF5 recording says of itself."""
    with reading(path, "HDF5") as file:
        return metadata_of(path, _description(file)) if _is_own(file) else _attributes(file)


def write(table: Table, path: Path) -> None:
    """Write a table as HDF5, columns under names of their own, and what it says of itself."""
    stored_as = {name: _link(number, name) for number, name in enumerate(table.columns)}

    def fill(file: File) -> None:
        file.attrs["schema"] = SCHEMA
        group = file.create_group(COLUMNS, track_order=True)
        for name, column in table.columns.items():
            _require_no_nul(table.path, name, column)
            _write_column(group, stored_as[name], column, table.units.get(name))
        file.create_dataset(DESCRIPTION, data=description_of(table, stored_as))

    write_whole(path, fill)


def _write_column(group: File, name: str, column: Column, unit: str | None) -> None:
    import h5py

    if ColumnKind.of(column) is ColumnKind.TEXT:  # HDF5 has no checksum for texts of any length
        dataset = group.create_dataset(name, data=column, compression="gzip", dtype=h5py.string_dtype())
    else:
        dataset = group.create_dataset(name, data=column, compression="gzip", fletcher32=True)
    if unit is not None:
        dataset.attrs["unit"] = unit


def _require_no_nul(path: Path, name: str, column: Column) -> None:
    row = (
        next((k for k, cell in enumerate(column) if "\0" in cell), None)
        if ColumnKind.of(column) is ColumnKind.TEXT
        else None
    )
    if row is not None:
        raise RecordingError(
            path, f"column {name}, row {row + 1}: expected a text without NUL, which ends one in HDF5. Write Parquet."
        )


def _link(number: int, name: str) -> str:
    """Name a dataset: like the column, where HDF5 takes that."""
    return name if not set("/\0") & set(name) and name not in ("", ".") else f"column {number + 1}"


def _is_own(file: File) -> bool:
    return file.attrs.get("schema") == SCHEMA and DESCRIPTION in file


def _description(file: File) -> str:
    return bytes(file[DESCRIPTION][()]).decode("utf-8")


def _own(path: Path, file: File) -> Table:
    return described_table(path, _description(file), lambda stored_as, _: _cells(file[COLUMNS][stored_as]))


def _cells(dataset: Dataset) -> Column:
    return as_column(dataset[()].ravel())


def _foreign(path: Path, file: File, request: Request) -> Table:
    vectors: dict[str, Column] = {}
    units: dict[str, str] = {}
    remarks: list[str] = []
    frames: list[str] = []

    def take(raw: str | bytes, entry: Any) -> None:
        name = text_of(raw)
        if not hasattr(entry, "dtype"):
            if found := _of_pandas(entry):
                frames.append(name)
                vectors.update(found)
            return
        if any(name.startswith(f"{frame}/") for frame in frames):
            return
        fields = (
            {f"{name}/{text_of(field)}": entry[field] for field in entry.dtype.names or ()} if entry.ndim == 1 else {}
        )
        found = fields or (dict(vectors_of(name, entry[()])) if entry.dtype.names is None else {})
        usable = {key: values for key, values in found.items() if is_column(values)}
        vectors.update({key: as_column(values) for key, values in usable.items()})
        if unit := _unit(entry):
            units.update(dict.fromkeys(usable, unit))
        if not usable:
            remarks.append(f"{name}: left out, it is no vector of numbers or texts")

    file.visititems(take)
    chosen, others = columns_of_shared_length(under_names(vectors, request.names), request.names)
    return Table(path, chosen, units, _attributes(file), remarks=(*others, *remarks))


def _of_pandas(group: Any) -> dict[str, Column]:
    """Return the columns of a frame that pandas wrote, fixed or as a table, without its library, which unpickles."""
    kind = group.attrs.get("pandas_type")
    if kind == b"frame" or kind == "frame":
        found = {"index": group["axis1"][()]} if "axis1" in group else {}
        for block in range(int(group.attrs["nblocks"])):
            items = [text_of(name) for name in group[f"block{block}_items"][()].tolist()]
            values = group[f"block{block}_values"][()]
            found.update({name: values[:, k] for k, name in enumerate(items)})
        order = [text_of(name) for name in group["axis0"][()].tolist()]
        found = {name: found[name] for name in ("index", *order) if name in found}
    elif kind in (b"frame_table", "frame_table"):
        rows = group["table"][()]
        found = {"index": rows["index"]}
        for field in (name for name in rows.dtype.names if name != "index"):
            names = _names_of_block(group["table"], field)
            values = rows[field].reshape(rows.size, -1)
            found.update({name: values[:, k] for k, name in enumerate(names)} if names else {field: values[:, 0]})
    else:
        return {}
    return {name: as_column(values) for name, values in found.items() if is_column(values)}


def _names_of_block(table: Any, field: str) -> list[str]:
    """Return the names of the columns in a block of a table of pandas, which are pickled as a list of plain texts."""
    raw = table.attrs.get(f"{field}_kind")
    text = bytes(raw).decode("latin-1") if raw is not None else ""
    return PICKLED_TEXT.findall(text)


def _unit(dataset: Dataset) -> str:
    found = next((dataset.attrs[key] for key in ("unit", "units") if key in dataset.attrs), "")
    return str(as_column(np.array([found]))[0])


def _attributes(file: File) -> dict[str, str]:
    return {text_of(name): str(value) for name, value in file.attrs.items() if np.ndim(value) == 0}
