"""Recordings written whole or not at all, and read back before they get their name.

The recording is written next to its place, read again, and compared with what was to be written, bit for bit: a format
that can't hold something is found by what it did, not by what is known of it. Whoever converts may continue all the
same, and is informed of each loss; what is kept then carries the checksum of what was kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace as changed
from pathlib import Path

import numpy as np

from hil.errors import RecordingError
from hil.files import part_of
from hil.recording.bounds import no_room
from hil.recording.checksum import CHECKSUMS, sealed
from hil.recording.formats import FORMATS, Format, writer_for
from hil.recording.request import Request
from hil.recording.table import Column, ColumnKind, Table

_SHOWN = 40


def losses(before: Table, after: Table) -> list[str]:
    """Name what of `before` is not in `after`, one line each; empty where all of it is, bit for bit.

    NaN equals NaN, whatever its payload. Checksums are no content of their own and are not compared.
    """
    return [*_columns(before, after), *_units(before, after), *_metadata(before, after)]


def _columns(before: Table, after: Table) -> list[str]:
    lost = []
    for name, column in before.columns.items():
        if name not in after.columns:
            lost.append(f"column {name}: lost")
        elif problem := _cells(column, after.columns[name]):
            lost.append(f"column {name}: {problem}")
    if not lost and list(before.columns) != list(after.columns):
        lost.append("the order of the columns")
    return lost


def _cells(before: Column, after: Column) -> str:
    if before.shape != after.shape:
        return f"expected {before.size} cells, got {after.size}"
    kinds = ColumnKind.of(before), ColumnKind.of(after)
    changed = np.flatnonzero(~_same(before, after))
    if kinds[0] is not kinds[1]:
        return f"{kinds[0].value} becomes {kinds[1].value}"
    if changed.size:
        row = int(changed[0])
        shown = " becomes ".join(repr(column[row])[:_SHOWN] for column in (before, after))
        return f"{changed.size} of {before.size} cells change, the first in row {row + 1}: {shown}"
    return ""


def _same(before: Column, after: Column) -> Column:
    if before.dtype != after.dtype:
        return np.zeros(before.shape, dtype=np.bool_)
    if ColumnKind.of(before) is ColumnKind.FLOAT:
        same_bits = before.view(np.int64) == after.view(np.int64)  # tells 0.0 from -0.0
        return np.asarray(same_bits | (np.isnan(before) & np.isnan(after)))
    return np.asarray(before == after, dtype=np.bool_)


def _units(before: Table, after: Table) -> list[str]:
    return [
        f"unit of column {name}: {unit!r} becomes {after.units[name]!r}"
        if name in after.units
        else f"unit of column {name}: {unit!r} is lost"
        for name, unit in before.units.items()
        if name in before.columns and after.units.get(name) != unit
    ]


def _metadata(before: Table, after: Table) -> list[str]:
    return [
        f"metadata {key}: changed" if key in after.metadata else f"metadata {key}: lost"
        for key, value in before.metadata.items()
        if key not in CHECKSUMS and after.metadata.get(key) != value
    ]


def write_table(
    table: Table, path: Path | str, *, replace: bool = False, on_loss: Callable[[Sequence[str]], None] | None = None
) -> None:
    """Write a recording, whole or not at all; the suffix chooses the format, and its data get a checksum.

    ``replace`` lets it take the place of one of that name. What the format can't hold is given to ``on_loss``, a line
    each; without it such a table is refused with a `RecordingError`, as one that the disk does not take is.
    """
    path = Path(path)
    write = writer_for(path, replace)
    form = FORMATS[path.suffix.lower()]
    part = part_of(path)

    def written(content: Table) -> Table:
        """Write, and read what was written."""
        try:
            write(sealed(changed(content, path=path)), part)
            return form.read(part, Request())
        except RecordingError as error:  # it names the part file, which nobody asked for
            raise RecordingError(path, *error.problems) from error

    try:
        _write(table, path, written, on_loss)
        _publish(part, path, form)
    except OSError as error:
        raise no_room(path, "the recording", error) from error
    finally:
        for file in (part, *([] if form.companion is None else [form.companion(part)])):
            if file.is_file():  # on a disk that can't be written even removing nothing is refused
                file.unlink()


def _write(
    table: Table, path: Path, written: Callable[[Table], Table], on_loss: Callable[[Sequence[str]], None] | None
) -> None:
    kept = written(table)
    lost = losses(table, kept)
    if not lost:
        return
    if on_loss is None:
        raise RecordingError(path, *(f"{what}: {path.suffix} can't hold it. Choose another format." for what in lost))
    on_loss(lost)
    plain = changed(kept, metadata={key: value for key, value in kept.metadata.items() if key not in CHECKSUMS})
    if still := losses(plain, written(plain)):
        raise RecordingError(path, *(f"expected it to stay as it was written, got: {what}" for what in still))


def _publish(part: Path, path: Path, form: Format) -> None:
    """Give the files their names; a kill in between leaves a recording without metadata, never a wrong one.

    What stood next to a replaced recording goes first, for it describes that one.
    """
    if form.companion is not None:
        form.companion(path).unlink(missing_ok=True)
    part.replace(path)
    if form.companion is not None and form.companion(part).exists():
        form.companion(part).replace(form.companion(path))
