"""HDF5 files, read with every fault put into words, and written whole."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hil.errors import RecordingError
from hil.recording.bounds import require_cells
from hil.recording.damaged import damaged

CELL_BYTES = 8
"""Of the widest number; a longer element, such as a table's row, counts as several cells."""

DAMAGED = (OSError, KeyError, ValueError, TypeError, RuntimeError, IndexError, AttributeError)
"""What h5py raises on a file that is cut or damaged."""


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
