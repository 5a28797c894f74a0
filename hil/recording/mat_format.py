"""MATLAB .mat: versions 4 to 7 are read here, version 7.3 is read and written by `hil.recording.mat73_format`.

A .mat file is a bag of variables: the numeric vectors of the length that most of them share are the columns, scalars
are metadata.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hil.recording import mat73_format
from hil.recording.damaged import damaged
from hil.recording.format_hints import FormatHints
from hil.recording.kinds import as_column
from hil.recording.shared_length import columns_of_shared_length
from hil.recording.table import Table

DAMAGED = (ValueError, TypeError, IndexError, KeyError, OSError, NotImplementedError, zlib.error)
"""What scipy raises, beside its own, on a file that is cut or no .mat file."""


def read(path: Path, hints: FormatHints) -> Table:
    """Read a .mat recording; hints are for text formats and play no part.

    Raises
    ------
    RecordingError
        If the file is damaged, or holds no numeric vector.
    """
    import scipy.io
    from scipy.io.matlab import MatReadError

    if is_version_73(path):
        return mat73_format.read(path)
    try:
        variables = scipy.io.loadmat(path)
    except (*DAMAGED, MatReadError) as error:
        raise damaged(path, "a whole .mat file", error) from error
    arrays = {name: value for name, value in variables.items() if isinstance(value, np.ndarray)}
    numeric = {name: value for name, value in arrays.items() if value.dtype.kind in "fiub"}
    vectors = {name: v.ravel() for name, v in numeric.items() if v.size > 1 and max(v.shape) == v.size}
    scalars = {name: repr(value.item()) for name, value in numeric.items() if value.size == 1}
    chosen, remarks = columns_of_shared_length(vectors)
    other = [f"{name}: left out, it is no vector of numbers" for name in arrays if name not in {**vectors, **scalars}]
    columns = {name: as_column(vector) for name, vector in chosen.items()}
    return Table(path, columns, metadata=scalars, remarks=(*remarks, *other))


def read_metadata(path: Path) -> Mapping[str, str]:
    """Read what a .mat recording says of itself."""
    return mat73_format.read_metadata(path) if is_version_73(path) else read(path, FormatHints()).metadata


def write(table: Table, path: Path) -> None:
    """Write a table, as version 7.3."""
    mat73_format.write(table, path)


def is_version_73(path: Path) -> bool:
    """Whether a .mat file is HDF5 inside; its header says so (MAT-File Format, version 7.3)."""
    with path.open("rb") as file:
        return file.read(len(mat73_format.TITLE)) == mat73_format.TITLE
