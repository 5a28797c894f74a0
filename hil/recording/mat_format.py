"""MATLAB .mat, versions 4 to 7: the numeric vectors of one length are the columns, scalars are metadata.

A .mat file is a bag of variables. The length that most vectors share is taken as that of the recording (the
longest, where two are equally frequent); vectors of other lengths are left out.
"""

from __future__ import annotations

import zlib
from collections import Counter
from pathlib import Path

import numpy as np
import scipy.io
from scipy.io.matlab import MatReadError

from hil.errors import RecordingError
from hil.recording.format_hints import FormatHints
from hil.recording.table import Column, Table

DAMAGED = (MatReadError, ValueError, TypeError, IndexError, KeyError, OSError, zlib.error)
"""What scipy raises on a file that is cut or no .mat file."""


def read(path: Path, hints: FormatHints) -> Table:
    """Read a .mat recording; hints are for text formats and play no part.

    Raises
    ------
    RecordingError
        If the file is damaged, of version 7.3, or holds no numeric vector.
    """
    try:
        variables = scipy.io.loadmat(path)
    except NotImplementedError as error:
        raise RecordingError(
            path, "expected MATLAB version 4 to 7, came version 7.3 (HDF5). Save it again with -v7."
        ) from error
    except DAMAGED as error:
        raise RecordingError(path, f"expected a whole .mat file, came a damaged or truncated one ({error})") from error
    numeric = {
        name: value for name, value in variables.items() if isinstance(value, np.ndarray) and value.dtype.kind in "fiub"
    }
    vectors = {name: v.ravel() for name, v in numeric.items() if v.size > 1 and max(v.shape) == v.size}
    scalars = {name: repr(value.item()) for name, value in numeric.items() if value.size == 1}
    counts = Counter(vector.size for vector in vectors.values())
    length = max(counts, key=lambda size: (counts[size], size), default=0)
    columns = {name: _column(vector) for name, vector in vectors.items() if vector.size == length}
    return Table(path, columns, metadata=scalars)


def _column(vector: Column) -> Column:
    return vector.astype(np.float64 if vector.dtype.kind == "f" else np.int64)
