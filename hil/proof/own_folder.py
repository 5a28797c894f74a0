"""Folders of results that are replaced by newer ones: only such as this program has made itself, by a mark in them."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from hil.errors import UsageError

MARK: Final = ".made-by-hil"
"""File that says so."""

TEXT: Final = "This folder was made by hil, which replaces it when it makes the results anew.\n"


def replace_own(folder: Path, built: Path) -> None:
    """Copy a folder to where it belongs, in place of the one that was made there before.

    Raises
    ------
    UsageError
        If there is something that this program did not make; it is left as it is.
    """
    if folder.is_symlink() or folder.exists():
        if folder.is_symlink() or not (folder / MARK).is_file():
            raise UsageError(
                f"{folder}: expected no such folder, or one of earlier results ({MARK} in it), got something else. "
                "It is left as it is: move it away."
            )
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    (folder / MARK).write_text(TEXT, encoding="utf-8")  # first: half a copy is this program's too
    shutil.copytree(built, folder, dirs_exist_ok=True)
