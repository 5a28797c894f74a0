"""MATLAB .mat: versions 4 to 7 are read here, version 7.3 is read and written by `hil.recording.mat73_format`.

A .mat file is a bag of variables: the numeric vectors of the length that most of them share are the columns, by their
address where they are fields of a struct, columns of a matrix or variables of a timetable; scalars are metadata.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from pathlib import Path

from hil.recording import mat73_format
from hil.recording.bounds import damaged, require_columns
from hil.recording.mat_variables import walk, with_tables_if_possible
from hil.recording.request import Request, under_names
from hil.recording.table import Column, Table, as_column, columns_of_shared_length

DAMAGED = (ValueError, TypeError, IndexError, KeyError, OSError, NotImplementedError, zlib.error)
"""What scipy raises, besides its own, on a file that is cut or no .mat file."""


def read(path: Path, request: Request) -> Table:
    """Read a .mat recording."""
    import scipy.io
    from scipy.io.matlab import MatReadError

    if is_version_73(path):
        return mat73_format.read(path, request)
    try:
        variables = scipy.io.loadmat(path, struct_as_record=False)
    except (*DAMAGED, MatReadError) as error:
        raise damaged(path, "a whole .mat file", error) from error
    variables = with_tables_if_possible(path, variables)
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
    return mat73_format.read_metadata(path) if is_version_73(path) else read(path, Request()).metadata


def write(table: Table, path: Path) -> None:
    """Write a table, as version 7.3."""
    mat73_format.write(table, path)


def is_version_73(path: Path) -> bool:
    """Whether a .mat file is HDF5 inside; its header says so (MAT-File Format, version 7.3: version 0x0200)."""
    with path.open("rb") as file:
        header = file.read(128)
    return header.startswith(mat73_format.TITLE) or header[124:] in (b"\x00\x02IM", b"\x02\x00MI")
