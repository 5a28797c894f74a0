"""Recordings written whole or not at all, and read back before they get their name.

The recording is written next to its place, read again, and compared with what was to be written, bit for bit: a format
that can't hold something is found by what it did, not by what is known of it. Whoever converts may continue all the
same, and is informed of each loss; what is kept then carries the checksum of what was kept.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace as changed
from pathlib import Path

from hil.errors import RecordingError
from hil.recording.checksum import CHECKSUMS, sealed
from hil.recording.differences import losses
from hil.recording.formats import FORMATS, Format, writer_for
from hil.recording.no_room import no_room
from hil.recording.request import Request
from hil.recording.table import Table


def write_table(
    table: Table,
    path: Path | str,
    *,
    replace: bool = False,
    on_loss: Callable[[Sequence[str]], None] | None = None,
) -> None:
    """Write a recording, whole or not at all.

    Parameters
    ----------
    table : Table
        What is written. One that has units or metadata gets the checksum of its data with them.
    path : Path or str
        Where to; the suffix chooses the format.
    replace : bool
        Whether a recording of that name may be replaced.
    on_loss : callable, optional
        Called with what the format can't hold, one line each; the rest is written then. Without it such a table is
        refused.

    Raises
    ------
    RecordingError
        As :func:`hil.recording.formats.writer_for`, if the format can't hold the content, or the disk does not.
    """
    path = Path(path)
    write = writer_for(path, replace)
    form = FORMATS[path.suffix.lower()]
    part = path.with_name(f".{path.name}.{os.getpid()}.part")

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
    table: Table,
    path: Path,
    written: Callable[[Table], Table],
    on_loss: Callable[[Sequence[str]], None] | None,
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
    """Give the files their names; a kill in between leaves a recording that says nothing of itself, never a wrong one.

    What stood next to a replaced recording goes first, for it describes that one.
    """
    if form.companion is not None:
        form.companion(path).unlink(missing_ok=True)
    part.replace(path)
    if form.companion is not None and form.companion(part).exists():
        form.companion(part).replace(form.companion(path))
