"""MATLAB .mat: versions 4 to 7 are read, version 7.3 is read and written.

A .mat file is a bag of variables: the numeric vectors of the length that most of them share are the columns, by their
address where they are fields of a struct, columns of a matrix or variables of a timetable; scalars are metadata.

Version 7.3 is HDF5 behind a header of 512 bytes, every dataset with the class MATLAB gives it. The header and the
attributes are those MATLAB writes (MAT-File Format, "Version 7.3"; attributes as ``save -v7.3`` leaves them, also
described by hdf5storage): `MATLAB_class` of every variable, `MATLAB_int_decode` where the class is not HDF5's type,
`MATLAB_empty` where there is nothing. MATLAB's arrays are column-major: a column of N is a dataset of shape (1, N).
Texts are a cell array; each different text is stored once and referred to.

MATLAB takes ASCII names of letters, digits and underscores only. Columns get such a name, and ``recording_json``, a
variable too, has the real one (`hil.recording.description`): ``info = jsondecode(recording_json)``.
"""

from __future__ import annotations

import itertools
import re
import zlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.foreign_file import open_regular
from hil.errors import RecordingError
from hil.recording.bounds import damaged, require_columns
from hil.recording.channels import seconds_since_first
from hil.recording.description import described_table, description_of, metadata_of
from hil.recording.hdf5_format import DESCRIPTION, Dataset, File, reading, text_of, write_whole
from hil.recording.request import Request, under_names, vectors_of
from hil.recording.table import Column, ColumnKind, Table, as_column, as_text, columns_of_shared_length

DAMAGED = (ValueError, TypeError, IndexError, KeyError, OSError, NotImplementedError, zlib.error)
"""What scipy raises, besides its own, on a file that is cut or no .mat file."""


OBJECTS: Final = "__function_workspace__"
"""Variable in which MATLAB keeps what its objects hold (versions 5 to 7)."""

TITLE = b"MATLAB 7.3 MAT-file"

HEADER = (
    (TITLE + b", Platform: hil, HDF5 schema 1.00 .").ljust(116) + bytes(8) + b"\x00\x02IM"
)  # text, no subsystem data, version 2.0, little-endian

REFERENCES = "#refs#"

LONGEST_NAME = 63  # characters of a variable's name that MATLAB distinguishes (``namelengthmax``)

DEEPEST: Final = 12  # structs inside structs that are looked into


def read(path: Path, request: Request) -> Table:
    """Read a .mat file of any version, one of this program whole; `RecordingError` where it is damaged."""
    import scipy.io
    from scipy.io.matlab import MatReadError

    if is_version_73(path):
        with reading(path, ".mat") as file:
            return _own(path, file) if DESCRIPTION in file else _foreign(path, file, request)
    try:
        variables = scipy.io.loadmat(path, struct_as_record=False)
    except (*DAMAGED, MatReadError) as error:
        raise damaged(path, "a whole .mat file", error) from error
    if OBJECTS in variables:
        with suppress(RecordingError):  # objects of other classes; what is none of them is read all the same
            variables = with_tables(path)
    vectors: dict[str, Column] = {}
    scalars: dict[str, str] = {}
    other: list[str] = []
    for name, value in variables.items():
        if not name.startswith("__"):
            walk(name, value, vectors, scalars, other)
    require_columns(path, len(vectors))
    chosen, remarks = columns_of_shared_length(under_names(vectors, request.names), request.names)
    columns = {name: as_column(vector) for name, vector in chosen.items()}
    left = [f"{name}: left out, it is no vector of numbers" for name in other]
    return Table(path, columns, metadata=scalars, remarks=(*remarks, *left))


def read_metadata(path: Path) -> Mapping[str, str]:
    """Read what a .mat recording says of itself."""
    if not is_version_73(path):
        return read(path, Request()).metadata
    with reading(path, ".mat") as file:
        return metadata_of(path, _text(file[DESCRIPTION])) if DESCRIPTION in file else _foreign_metadata(file)


def is_version_73(path: Path) -> bool:
    """Whether a .mat file is HDF5 inside; its header says so (MAT-File Format, version 7.3: version 0x0200)."""
    with open_regular(path) as file:
        header = file.read(128)
    return header.startswith(TITLE) or header[124:] in (b"\x00\x02IM", b"\x02\x00MI")


def write(table: Table, path: Path) -> None:
    """Write a table so that MATLAB loads it: a variable for each column, and ``recording_json``."""
    stored_as = variable_names(table.columns)

    def fill(file: File) -> None:
        for name, column in table.columns.items():
            if ColumnKind.of(column) is ColumnKind.TEXT:
                _write_cells(file, stored_as[name], column.tolist())
            else:
                _write_numbers(file, stored_as[name], column)
        _write_char(file, DESCRIPTION, description_of(table, stored_as))

    write_whole(path, fill, HEADER)


def variable_names(names: Iterable[str]) -> dict[str, str]:
    """Give every column a name that MATLAB takes, none of them twice."""
    given: dict[str, str] = {}
    taken = {DESCRIPTION}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
        plain = (plain if plain[:1].isalpha() else f"x{plain}")[:LONGEST_NAME]
        numbered = (f"{plain[: LONGEST_NAME - 10]}_{number}" for number in itertools.count(2))
        given[name] = plain if plain not in taken else next(other for other in numbered if other not in taken)
        taken.add(given[name])
    return given


def _write_numbers(file: File, name: str, column: Column) -> None:
    matlab_class = {ColumnKind.FLOAT: "double", ColumnKind.INTEGER: "int64", ColumnKind.BOOLEAN: "logical"}[
        ColumnKind.of(column)
    ]
    cells = column.astype(np.uint8) if matlab_class == "logical" else column
    dataset = file.create_dataset(name, data=cells[np.newaxis, :], compression="gzip", fletcher32=True)
    _classify(dataset, matlab_class, 1 if matlab_class == "logical" else 0)


def _write_cells(file: File, name: str, texts: list[str]) -> None:
    import h5py

    group = file.require_group(REFERENCES)
    places: dict[str, Any] = {}
    for text in dict.fromkeys(texts):
        places[text] = _write_char(group, f"t{len(group)}", text).ref
    references = np.empty((1, len(texts)), dtype=h5py.ref_dtype)
    references[0, :] = [places[text] for text in texts]
    _classify(file.create_dataset(name, data=references, dtype=h5py.ref_dtype), "cell")


def _write_char(group: File, name: str, text: str) -> Dataset:
    units = np.frombuffer(text.encode("utf-16-le"), dtype="<u2")
    if units.size:
        dataset = group.create_dataset(name, data=units[:, np.newaxis])
    else:  # an empty array is its size, and an attribute that says so
        dataset = group.create_dataset(name, data=np.zeros(2, dtype=np.uint64))
        dataset.attrs["MATLAB_empty"] = np.uint8(1)
    _classify(dataset, "char", 2)
    return dataset


def _classify(dataset: Dataset, matlab_class: str, decode: int = 0) -> None:
    dataset.attrs["MATLAB_class"] = np.bytes_(matlab_class)
    if decode:
        dataset.attrs["MATLAB_int_decode"] = np.int32(decode)


def _own(path: Path, file: File) -> Table:
    def column(stored_as: str, kind: ColumnKind) -> Column:
        cells = _cells(file, file[stored_as])
        return cells.astype(np.bool_) if kind is ColumnKind.BOOLEAN else cells

    return described_table(path, _text(file[DESCRIPTION]), column)


def _foreign(path: Path, file: File, request: Request) -> Table:
    vectors: dict[str, Column] = {}
    objects: list[str] = []
    _take(file, file, "", vectors, objects)
    if objects:
        opened = with_tables(path)
        for name in objects:
            walk(name, opened.get(name), vectors, {}, [])
    chosen, remarks = columns_of_shared_length(under_names(vectors, request.names), request.names)
    metadata = _foreign_metadata(file)
    roots = {re.split(r"[.(]", name)[0] for name in vectors}
    other = [
        f"{name}: left out, it is no vector of numbers or texts"
        for name in map(text_of, file)
        if not name.startswith("#") and name not in roots and name not in metadata
    ]
    return Table(path, chosen, metadata=metadata, remarks=(*remarks, *other))


def _take(file: File, group: File, inside: str, vectors: dict[str, Column], objects: list[str]) -> None:
    """Add the vectors of a struct's fields, and of structs in it; name what is an object of a class of MATLAB's."""
    for raw, entry in group.items():
        name = inside + text_of(raw)
        if name.startswith("#"):
            continue
        if "MATLAB_object_decode" in entry.attrs:
            objects.append(name)
        elif not hasattr(entry, "dtype"):
            _take(file, entry, f"{name}.", vectors, objects)
        elif entry.dtype.names is None and _is_vector(entry):
            vectors[name] = _cells(file, entry)
        elif _is_matrix(entry):
            vectors.update((address, as_column(cells)) for address, cells in vectors_of(name, entry[()].T))


def _is_matrix(dataset: Dataset) -> bool:
    is_numbers = dataset.dtype.kind in "fiu" and _class_of(dataset) != "char" and not dataset.attrs.get("MATLAB_empty")
    return is_numbers and len(dataset.shape) == 2 and min(dataset.shape) > 1


def _foreign_metadata(file: File) -> dict[str, str]:
    entries = {text_of(name): entry for name, entry in file.items() if hasattr(entry, "dtype")}
    datasets = {name: entry for name, entry in entries.items() if entry.dtype.names is None}
    scalars = {name: repr(d[()].item()) for name, d in datasets.items() if d.size == 1 and d.dtype.kind in "fiu"}
    texts = {name: _text(d) for name, d in datasets.items() if _class_of(d) == "char" and 1 in (*d.shape, d.ndim)}
    return {**scalars, **texts}


def _is_vector(dataset: Dataset) -> bool:
    is_cells = _class_of(dataset) == "cell" or (dataset.dtype.kind in "fiu" and _class_of(dataset) != "char")
    return (
        is_cells and dataset.size > 1 and max(dataset.shape) == dataset.size and not dataset.attrs.get("MATLAB_empty")
    )


def _cells(file: File, dataset: Dataset) -> Column:
    content = dataset[()].ravel()
    if _class_of(dataset) == "cell":
        texts = {reference: _text(file[reference]) for reference in set(content.tolist())}
        return as_text([texts[reference] for reference in content.tolist()])
    return as_column(content.astype(np.bool_) if _class_of(dataset) == "logical" else content)


def _text(dataset: Dataset) -> str:
    if dataset.attrs.get("MATLAB_empty"):
        return ""
    if _class_of(dataset) != "char":
        return str(dataset[()].ravel().tolist())
    return bytes(dataset[()].astype("<u2").tobytes()).decode("utf-16-le", "replace")


def _class_of(dataset: Dataset) -> str:
    return bytes(dataset.attrs.get("MATLAB_class", b"")).decode("ascii", "replace")


def with_tables(path: Path) -> dict[str, Any]:
    """Return the variables of a .mat file, tables among them as data frames."""
    from matio import load_from_mat

    try:
        variables: dict[str, Any] = load_from_mat(str(path))
    except Exception as error:  # the library raises anything on what it does not know
        raise damaged(path, "a whole .mat file", error) from error
    return variables


def columns_of(table: Any) -> dict[str, Any]:
    """Return the columns of a table, of a timetable its times first; times in seconds."""
    columns = {str(name): table[name].to_numpy() for name in table.columns}
    columns = {name: seconds_since_first(v) if v.dtype.kind in "mM" else v for name, v in columns.items()}
    if table.index.dtype.kind not in "mM":
        return columns
    return {str(table.index.name or "Time"): seconds_since_first(table.index.to_numpy()), **columns}


def walk(
    name: str, value: Any, vectors: dict[str, Column], scalars: dict[str, str], other: list[str], depth: int = 0
) -> None:
    """Put what is in a variable where it belongs."""
    if hasattr(value, "columns") and hasattr(value, "index"):  # a table
        fields = columns_of(value)
    elif hasattr(value, "_fieldnames"):
        fields = {field: getattr(value, field) for field in value._fieldnames}  # noqa: SLF001 - scipy's way to them
    elif isinstance(value, np.ndarray) and value.dtype.names is not None:
        fields = {field: value[field] for field in value.dtype.names}
    elif isinstance(value, dict):
        fields = value
    elif isinstance(value, np.ndarray) and value.dtype == object:
        parts = value.ravel(order="F").tolist()
        fields = {f"({k + 1})" if len(parts) > 1 else "": part for k, part in enumerate(parts)}
    else:
        _sort(name, np.asarray(value), vectors, scalars, other)
        return
    if depth >= DEEPEST or (isinstance(value, np.ndarray) and value.size > 64):
        other.append(name)
        return
    for key, part in fields.items():
        inside = name + key if not key or key.startswith("(") else f"{name}.{key}"
        walk(inside, part, vectors, scalars, other, depth + 1)


def _sort(name: str, array: Column, vectors: dict[str, Column], scalars: dict[str, str], other: list[str]) -> None:
    if array.dtype.kind in "fiub" and array.size == 1:
        scalars[name] = repr(array.item())
        return
    found = dict(vectors_of(name, array)) if array.dtype.kind in "fiub" else {}
    vectors.update(found)
    if not found:
        other.append(name)
