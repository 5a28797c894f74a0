"""Results of a command in a folder: all files are written next to it first and moved in when each is complete."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from hil.errors import UsageError


def require_folder(folder: Path) -> None:
    """Refuse a folder that can't be written to, before anything is computed."""
    existing = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not existing.is_dir():
        raise UsageError(f"{folder}: expected a folder to write into, got {existing}, which is a file")
    try:
        with tempfile.TemporaryFile(dir=existing):
            pass  # permissions alone don't tell: the disk may be full, or mounted read-only
    except OSError as error:
        raise _unwritable(folder, error) from error


def publish(folder: Path, files: Mapping[str, Callable[[Path], object]]) -> None:
    """Make files and move them into a folder; what was there under the same name is replaced."""
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
