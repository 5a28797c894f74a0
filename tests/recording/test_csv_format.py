"""CSV: what is read, and what is refused with its line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from hil.errors import RecordingError
from hil.recording import RecordingWriter, Table, csv_format, own_csv, read_table, write_table
from hil.recording.checksum import data_sha256
from hil.recording.recordings import read_facts
from hil.recording.request import FormatHints, Request
from tests.recording.test_writer import sample


def read(tmp_path: Path, content: str | bytes, hints: FormatHints | None = None) -> Table:
    path = tmp_path / "run.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return csv_format.read(path, Request(hints or FormatHints()))


def test_integers_floats_and_text_are_reported_apart_by_their_cells(tmp_path: Path) -> None:
    table = read(tmp_path, "a,b,c\n1,1.0,x\n-2,nan,\n")
    assert table.columns["a"].dtype == np.int64
    assert table.columns["a"].tolist() == [1, -2]
    assert table.columns["b"].dtype == np.float64
    np.testing.assert_array_equal(table.columns["b"], [1.0, np.nan])
    assert table.columns["c"].tolist() == ["x", ""]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_every_line_end_reads_alike(tmp_path: Path, end: str) -> None:
    table = read(tmp_path, end.join(["a,b", "1,2", "3,4", "", ""]))
    assert {name: column.tolist() for name, column in table.columns.items()} == {"a": [1, 3], "b": [2, 4]}


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
def test_the_delimiter_is_read_off_the_header(tmp_path: Path, delimiter: str) -> None:
    table = read(tmp_path, f"a{delimiter}b\n1{delimiter}2.5\n")
    assert {name: column.tolist() for name, column in table.columns.items()} == {"a": [1], "b": [2.5]}


def test_an_encoding_and_quoted_names_are_read(tmp_path: Path) -> None:
    table = read(tmp_path, 'T [°C];"a;b"\n1;2\n'.encode("latin-1"), FormatHints(encoding="latin-1"))
    assert list(table.columns) == ["T [°C]", "a;b"]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_is_no_part_of_the_first_name(tmp_path: Path, encoding: str) -> None:
    given = "utf-8" if encoding == "utf-8-sig" else encoding
    table = read(tmp_path, "time_s,b\n1,2\n".encode(encoding), FormatHints(encoding=given))
    assert list(table.columns) == ["time_s", "b"]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "the file is empty or truncated"),
        ("\n\n", "the file is empty or truncated"),
        ("a,,c\n1,2,3\n", "line 1: cell 2 of the header is empty"),
        ("a,b\n", "the file is empty or truncated"),
        ("a,b", "the file is empty or truncated"),
        ("a,b\n1,2\n3,4,5\n6,7\n", "line 3: expected 2 cells as in the header, got 3; fix that line"),
        ("a,b\n1,2\n3,4\n5", "line 4: expected 2 cells as in the header, got 1; the file is truncated"),
        ('a,b\n1,2\n3,"4\n5,6\n', "line 3: expected every quoted cell to end on its line"),
        ('a,b\n1,"2\n3"\n5,6\n', "line 2: expected every quoted cell to end on its line"),
        (b"a,b\n1,2\n3,\xe94\n", "line 3: expected utf-8 text, got byte 0xe9"),
        (b"\xff\xfea\x00b", "expected utf-16 text"),
        ("a,b\n1," + "2" * 9_000_000 + "\n", "line 2: expected 2 cells as in the header, got 1"),
        ("a,b\n1,2\n\n3,4\n", "line 3: expected a row, got an empty line"),
    ],
    ids=range(13),
)
def test_a_file_that_is_no_table_is_refused_by_line(tmp_path: Path, content: str | bytes, said: str) -> None:
    with pytest.raises(RecordingError) as refusal:
        read(tmp_path, content)
    assert said in str(refusal.value)
    assert "run.csv" in str(refusal.value)


@pytest.mark.parametrize("cell", ["abc", "1,5", "inf", "1e999", "--"])
def test_a_cell_that_is_no_number_is_refused_by_line_and_column(tmp_path: Path, cell: str) -> None:
    table = read(tmp_path, f"a;b\n1;2.0\n3;{cell}\n5;6\n")
    with pytest.raises(RecordingError) as refusal:
        table.numeric(["a", "b"])
    assert "line 3, column b: expected a finite number or nan, got" in str(refusal.value)
    assert cell in str(refusal.value) or "inf" in str(refusal.value)


@pytest.mark.parametrize("delimiter", ['"', "\n", ".", "-", "1", "e", ";;"])
def test_delimiters_that_could_be_data_are_refused(delimiter: str) -> None:
    with pytest.raises(ValueError, match="delimiter"):
        FormatHints(delimiter=delimiter)


@pytest.mark.parametrize("name", ["|", "a;b;c", "one\ttwo", 'say "a|b|c"', "a,b"])
def test_a_column_name_with_a_delimiter_in_it_reads_back(tmp_path: Path, name: str) -> None:
    write_table(Table(Path("a.csv"), {name: np.arange(3)}), tmp_path / "a.csv")
    assert list(read_table(tmp_path / "a.csv").columns) == [name]


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
