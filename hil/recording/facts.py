"""What a store or a list needs to know of a recording: what it says of itself and how much it holds, not its rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.recording import columns
from hil.recording.checksum import require_unchanged
from hil.recording.formats import format_of, read_table
from hil.recording.own_csv import Extent, data_sha256_at, extent, is_own
from hil.recording.sidecar import read_sidecar
from hil.recording.table import Table

CSV = ".csv"


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of a recording whose rows are not kept."""

    path: Path
    metadata: Mapping[str, str]
    extent: Extent


def facts_of(table: Table) -> Facts:
    """Return the facts of a table."""
    there = table.numeric([name for name in (columns.TIME, columns.FLAGS) if name in table.columns])
    time_s = there.get(columns.TIME, np.zeros(1))
    flagged = int(np.count_nonzero(there[columns.FLAGS])) if columns.FLAGS in there else 0
    return Facts(table.path, table.metadata, Extent(table.n_rows, float(time_s[0]), float(time_s[-1]), flagged))


def read_facts(path: Path) -> Facts:
    """Read a recording once, in memory that does not grow where it is a CSV of this rig, and return its facts."""
    format_of(path)
    if path.suffix.lower() == CSV and is_own(path) and (said := read_sidecar(path)).found and not said.types:
        try:
            held = extent(path)
            require_unchanged(path, said.metadata, said.units, lambda: data_sha256_at(path, held.n_rows))
        except ValueError:  # changed by hand: the reader of all forms of text says where
            return facts_of(read_table(path))
        if held.n_rows:
            return Facts(path, said.metadata, held)
    return facts_of(read_table(path))
