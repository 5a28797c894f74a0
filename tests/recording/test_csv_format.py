"""CSV: what is read, and what is refused with its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hil.errors import RecordingError
from hil.recording import Table, csv_format, read_table, write_table
from hil.recording.request import FormatHints, Request


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
