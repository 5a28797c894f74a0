"""A recording of this rig as CSV, summed up block by block: as from a table, in memory that does not grow."""

from __future__ import annotations

import math
from pathlib import Path

import pyarrow as pa
import pytest

from hil.errors import RecordingError
from hil.recording import RecordingWriter, own_csv, read_table
from hil.recording.checksum import data_sha256
from hil.recording.recordings import read_facts
from tests.recording.test_writer import sample

ROW = "1.0,0.5,nan,-0.0,5e-324,1e+16,16,inf,0.1,0.0\n"
"""Numbers at the edges of what a float has."""


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    with RecordingWriter(tmp_path / "run.csv", {"experiment": "cruise"}) as writer:
        for k in range(200):
            writer.append(sample(k))
    return tmp_path / "run.csv"


@pytest.mark.parametrize("held_bytes", [1, 3000, 1 << 25])
@pytest.mark.parametrize("block_bytes", [500, 1 << 20])
def test_the_checksum_is_that_of_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, held_bytes: int, block_bytes: int
) -> None:
    monkeypatch.setattr(own_csv, "HELD_BYTES", held_bytes)
    monkeypatch.setattr(own_csv, "BLOCK_BYTES", block_bytes)
    path = tmp_path / "run.csv"
    path.write_text(own_csv.HEADER + "\n" + 100 * ROW, "utf-8")
    assert own_csv.data_sha256_at(path, own_csv.extent(path).n_rows) == data_sha256(read_table(path).columns)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("\n0.05,", "\n0.06,", "expected the data it was written with"),
        ("\n0.05,", "\nx,", "expected the data it was written with"),
        ("\n0.05,", "\n0.05,1.0,", "line 7: expected 10 cells as in the header, got 11"),
    ],
)
def test_a_changed_recording_is_refused_as_the_table_is(recorded: Path, before: str, after: str, said: str) -> None:
    recorded.write_text(recorded.read_text("utf-8").replace(before, after, 1), "utf-8")
    for reads in (read_facts, read_table):
        with pytest.raises(RecordingError, match=said):
            reads(recorded)


def test_the_cells_in_memory_do_not_grow_with_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is held by the parser, and by the columns that wait for their turn."""
    monkeypatch.setattr(own_csv, "BLOCK_BYTES", 1 << 14)
    monkeypatch.setattr(own_csv, "HELD_BYTES", 1 << 16)
    row = ",".join("0" if name == "flags" else repr(math.pi) for name in own_csv.columns.UNITS) + "\n"
    held: list[int] = []
    take = own_csv.DataDigest.take

    def counted(digest: own_csv.DataDigest, cells: own_csv.Column) -> None:
        held.append(pa.total_allocated_bytes())
        take(digest, cells)

    monkeypatch.setattr(own_csv.DataDigest, "take", counted)
    most = []
    for n_rows in (20_000, 80_000):
        path = tmp_path / f"{n_rows}.csv"
        path.write_text(own_csv.HEADER + "\n" + n_rows * row, "utf-8")
        held.clear()
        own_csv.data_sha256_at(path, n_rows)
        most.append(max(held))
    assert most[1] < 80_000 * 8 * 2
    assert most[1] < 1.5 * most[0]
