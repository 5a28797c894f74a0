"""The store of a folder that has one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hil.errors import UsageError

if TYPE_CHECKING:
    from hil.store import RunStore


def opened(folder: Path) -> RunStore:
    """Open the store of a folder; a look must not make one.

    Raises
    ------
    UsageError
        If there is none.
    StoreError
        If it can't be read.
    """
    from hil.store import RunStore, store_of

    if not store_of(folder).exists():
        raise UsageError(
            f"{store_of(folder)}: expected a store of runs, there is none. 'hil run' makes one next to its recording, "
            f"'hil runs rebuild --store {folder}' makes one of the recordings there."
        )
    return RunStore(folder)
