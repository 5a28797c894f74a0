"""Results of a command in a folder: all files are written next to it first and moved in when each is complete."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from hil.errors import UsageError


def require_folder(folder: Path) -> None:
    """Refuse a folder that can't be written to, before anything is computed.

    Raises
    ------
    UsageError
        If the name, or one above it, is that of a file, or writing is not allowed there.
    """
    existing = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not existing.is_dir():
        raise UsageError(f"{folder}: expected a folder to write into, got {existing}, which is a file")
    try:
        with tempfile.TemporaryFile(dir=existing):
            pass  # permissions alone don't tell: the disk may be full, or mounted read-only
    except OSError as error:
        raise _unwritable(folder, error) from error


def publish(folder: Path, files: Mapping[str, Callable[[Path], object]]) -> None:
    """Make files and move them into a folder; what was there under the same name is replaced.

    Parameters
    ----------
    folder
        Made where it is not there.
    files
        File name to what writes it, given the path to write to.

    Raises
    ------
    UsageError
        If the folder, or the disk it is on, does not take them, or a file has the name of a folder that is there.
    """
    for path in (folder / name for name in files):
        if path.is_dir():
            raise UsageError(f"{path}: expected the name of a file to write, got a folder. Name a file in it.")
    require_folder(folder)
    try:
        _publish(folder, files)
    except OSError as error:
        raise _unwritable(folder, error) from error


def _publish(folder: Path, files: Mapping[str, Callable[[Path], object]]) -> None:
    is_new = not folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".unfinished-") as workshop:
            for name, write in files.items():
                write(Path(workshop) / name)
            for name in files:
                (Path(workshop) / name).replace(folder / name)
    except BaseException:
        if is_new and not any(folder.iterdir()):
            folder.rmdir()
        raise


def _unwritable(folder: Path, error: OSError) -> UsageError:
    return UsageError(
        f"{folder}: expected a folder to write into, got: {error.strerror or error}. Make room there, or choose "
        "another with --out."
    )
