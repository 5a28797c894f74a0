"""Text files as Excel, CANape, INCA, MATLAB and NumPy write them: one small file of our own for each form."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hil.errors import RecordingError
from hil.recording import SignalsConfig, read_record, read_table
from hil.recording.scales import wrapped_at
from hil.recording.text_form import CellKind, kind_of

ROWS = 60
TIME = np.arange(ROWS) * 0.01
TORQUE = np.round(50.0 * np.sin(TIME * 9.0), 2)
SPEED = np.round(100.0 * np.cos(TIME * 3.0), 3)
RPM = 2.0 * math.pi / 60.0

SIGNALS = SignalsConfig.model_validate({"time": {"column": "t"}, "torque": [{"column": "T"}], "speed": {"column": "n"}})


def lines(delimiter: str = ",", decimal: str = ".", end: str = "") -> list[str]:
    """The rows of a recording of t, T and n."""
    rows = zip(TIME.tolist(), TORQUE.tolist(), SPEED.tolist(), strict=True)
    return [delimiter.join(f"{cell:.4f}" for cell in row).replace(".", decimal) + end for row in rows]


def text(*head: str, delimiter: str = ",", decimal: str = ".", end: str = "") -> str:
    return "\n".join([*head, *lines(delimiter, decimal, end)]) + "\n"


FORMS: dict[str, tuple[str, str]] = {
    "Excel, German": (text("t;T;n", delimiter=";", decimal=","), "a semicolon between cells, decimal comma"),
    "sep=": (text("sep=;", "t;T;n", delimiter=";"), "a semicolon between cells, names in line 2"),
    "tab": (text("t\tT\tn", delimiter="\t"), "a tab between cells"),
    "blanks": (text("  t   T     n", delimiter="   "), "blanks between cells"),
    "CANape": (
        text("t;T;n", "s;Nm;1/min", delimiter=";", decimal=","),
        "a semicolon between cells, decimal comma, units in line 2",
    ),
    "INCA": (
        text("ETASAsciiItemFile,record,", f"sampleCount,{ROWS},", "t,T,n", "f8,f8,f8", "s,Nm,rpm"),
        "names in line 3, units in line 5",
    ),
    "lines before the header": (
        text("Prüfstand 4; 12.3.2026", "", "Fahrer: N. N.", "t,T,n"),
        "names in line 4",
    ),
    "keys and values before the header": (
        text("vehicle,bus 17,", "mass,14000,", "t,T,n"),
        "names in line 3",
    ),
    "comments": (text("# a bench", "t,T,n"), "names in line 2, lines that begin with # are comments"),
    "NumPy": (text("# t,T,n"), "lines that begin with # are comments"),
    "a delimiter at the end of all lines": (text("t,T,n,", end=","), "a delimiter ends every row"),
    "a delimiter at the end of the rows": (text("t,T,n", end=","), "a delimiter ends every row"),
    "a delimiter at the end of the header": (text("t,T,n,"), ""),
    "nothing next to": (text("t,T,n"), ""),
}


def written(tmp_path: Path, content: str, name: str = "run.csv", encoding: str = "utf-8") -> Path:
    path = tmp_path / name
    path.write_bytes(content.encode(encoding))
    return path


@pytest.mark.parametrize("form", FORMS)
def test_a_form_is_recognised_and_said(tmp_path: Path, form: str) -> None:
    content, said = FORMS[form]
    table = read_table(written(tmp_path, content))
    assert list(table.columns) == ["t", "T", "n"]
    np.testing.assert_allclose(table.columns["T"], TORQUE)
    np.testing.assert_allclose(table.columns["n"], SPEED)
    assert table.remarks == ((said,) if said else ())


@pytest.mark.parametrize("form", FORMS)
def test_a_row_cut_short_is_refused_by_its_line_in_every_form(tmp_path: Path, form: str) -> None:
    content, _ = FORMS[form]
    whole = content.rstrip("\n").split("\n")
    whole[-3] = whole[-3][:4]
    with pytest.raises(RecordingError, match=f"line {len(whole) - 2}: expected . cells"):
        read_table(written(tmp_path, "\n".join(whole)))


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".tsv"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_unicode_is_recognised_under_every_suffix(tmp_path: Path, suffix: str, encoding: str) -> None:
    path = written(tmp_path, text("t\tT\tn", delimiter="\t"), f"run{suffix}", encoding)
    assert read_table(path).columns["n"].tolist() == SPEED.tolist()


def test_empty_cells_are_missing_samples(tmp_path: Path) -> None:
    rows = lines()
    rows[7] = rows[7].split(",")[0] + ",,"
    rows[9] = rows[9].rsplit(",", 1)[0] + ",NA"
    record = read_record(written(tmp_path, "\n".join(["t,T,n", *rows])), SIGNALS)
    assert np.flatnonzero(~record.okay).tolist() == [7, 9]
    assert record.torque_nm[7, 0] == TORQUE[6]


def test_a_name_that_comes_twice_is_numbered_so_that_neither_is_taken_by_chance(tmp_path: Path) -> None:
    path = written(tmp_path, text("t,T,T"))
    table = read_table(path)
    assert list(table.columns) == ["t", "T (1)", "T (2)"]
    with pytest.raises(RecordingError, match=r"line 1: column T comes twice or more, as T \(1\) and T \(2\)"):
        table.numeric(["T"])


@pytest.mark.parametrize(
    ("stamp", "start"),
    [
        ("2026-03-12T10:00:{:06.3f}", "2026-03-12T10:00:00.000"),
        ("2026-03-12 10:00:{:06.3f}Z", "2026-03-12 10:00:00.000Z"),
        ("2026-03-12T10:00:{:06.3f}+01:00", "2026-03-12T10:00:00.000+01:00"),
    ],
)
def test_dates_with_times_are_read_as_seconds(tmp_path: Path, stamp: str, start: str) -> None:
    rows = [",".join([stamp.format(t), *row.split(",")[1:]]) for t, row in zip(TIME, lines(), strict=True)]
    table = read_table(written(tmp_path, "\n".join(["t,T,n", *rows])))
    np.testing.assert_allclose(table.columns["t"], TIME, atol=1e-9)
    assert table.units["t"] == "s"
    assert table.remarks == (f"t: dates and times, read as seconds since {start}",)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "s"), (1e3, "ms"), (1e6, "us")])
def test_a_time_since_the_epoch_is_a_time(tmp_path: Path, scale: float, unit: str) -> None:
    rows = [
        ",".join([f"{(1.77e9 + t) * scale:.3f}", *row.split(",")[1:]]) for t, row in zip(TIME, lines(), strict=True)
    ]
    record = read_record(written(tmp_path, "\n".join(["t,T,n", f"{unit},Nm,rad/s", *rows])), SIGNALS)
    assert record.sample_time_s == 0.01


@pytest.mark.parametrize(
    ("torque", "speed", "factors"),
    [
        ("Nm", "rad/s", (1.0, 1.0)),
        ("kNm", "1/min", (1e3, RPM)),
        ("N·m", "rpm", (1.0, RPM)),
        ("kN", "km/h", (1e3, 1.0 / 3.6)),
        ("lbf ft", "°/s", (1.3558179483, math.pi / 180.0)),
        ("A", "V", (1.0, 1.0)),
    ],
)
def test_units_count_where_no_scale_is_given(
    tmp_path: Path, torque: str, speed: str, factors: tuple[float, float]
) -> None:
    path = written(tmp_path, text("t,T,n", f"s,{torque},{speed}"))
    said: list[str] = []
    record = read_record(path, SIGNALS, tell=said.append)
    np.testing.assert_allclose(record.torque_nm[:, 0], TORQUE * factors[0])
    np.testing.assert_allclose(record.output, SPEED * factors[1])
    assert sum("times" in line for line in said) == sum(factor != 1.0 for factor in factors)


@pytest.mark.parametrize(("unit", "factor"), [("%", "0.01"), ("‰", "0.001"), ("per mille", "0.001")])
def test_a_share_of_a_rated_value_needs_a_scale_and_the_message_says_which(
    tmp_path: Path, unit: str, factor: str
) -> None:
    path = written(tmp_path, text("t,T,n", f"s,{unit},rad/s"))
    with pytest.raises(RecordingError, match=rf"column T: .* in {unit} of a rated value .* scale = RATED \* {factor}"):
        read_record(path, SIGNALS)


def test_a_reading_stored_with_sign_and_read_without_is_reported_with_the_line_that_cures_it(tmp_path: Path) -> None:
    raw = np.round(TORQUE * 10.0).astype(np.int16).astype(np.uint16) * 0.1
    rows = [f"{t:.2f},{a:.1f},{b:.3f}" for t, a, b in zip(TIME, raw, SPEED, strict=True)]
    path = written(tmp_path, "\n".join(["t,T,n", *rows]))
    with pytest.raises(RecordingError, match=r"Write \{ column = 'T', wraps_at = 6553.6 \}"):
        read_record(path, SIGNALS)
    signals = SignalsConfig.model_validate(
        {"time": {"column": "t"}, "torque": [{"column": "T", "wraps_at": 6553.6}], "speed": {"column": "n"}}
    )
    np.testing.assert_allclose(read_record(path, signals).torque_nm[:, 0], TORQUE, atol=0.06)


@pytest.mark.parametrize(
    "values",
    [
        np.where(np.arange(60) % 20 == 7, 0.0, 60.0 + 0.001 * (np.arange(60) % 7)),  # lost readings are zero
        60000.0 + np.arange(60.0),
        np.abs(np.round(30000.0 * np.sin(np.arange(60) / 9.0))),
        np.where(np.arange(60) < 30, 0.0, 65535.0),
    ],
    ids=["lost", "large", "a magnitude", "two levels"],
)
def test_what_only_looks_like_a_wrap_is_left_alone(values: np.ndarray) -> None:
    assert wrapped_at(values) is None


def stamped(tmp_path: Path, stamps: np.ndarray) -> Path:
    rows = [",".join([f"{t:.6f}", *row.split(",")[1:]]) for t, row in zip(stamps, lines(), strict=True)]
    return written(tmp_path, "\n".join(["t,T,n", *rows]))


@pytest.mark.parametrize("row", [1, 5, 30, 50, 58])
def test_a_stamp_that_is_repeated_is_no_rounding(tmp_path: Path, row: int) -> None:
    stamps = TIME.copy()
    stamps[row] = stamps[row - 1]
    with pytest.raises(RecordingError, match=f"line {row + 2}, column t: expected a time greater than in the row bef"):
        read_record(stamped(tmp_path, stamps), SIGNALS)


@pytest.mark.parametrize("row", [1, 5, 30, 50, 58])
def test_a_row_left_out_is_no_jitter(tmp_path: Path, row: int) -> None:
    path = stamped(tmp_path, np.arange(ROWS) * 0.01 + (np.arange(ROWS) >= row) * 0.01)
    with pytest.raises(RecordingError, match=f"line {row + 2}, column t: expected a uniform step"):
        read_record(path, SIGNALS)


@pytest.mark.parametrize("line", ["1," * 3_000_000, "," * 3_000_000, "a;" * 3_000_000 + "\n1\n"])
def test_a_line_of_millions_of_cells_is_refused_before_they_are_looked_at(
    tmp_path: Path, line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked_at = 0

    def counted(cell: str, decimal: str = ".") -> CellKind:
        nonlocal looked_at
        looked_at += 1
        return kind_of(cell, decimal)

    monkeypatch.setattr("hil.recording.text_form.kind_of", counted)
    with pytest.raises(RecordingError, match="expected"):
        read_table(written(tmp_path, line))
    assert looked_at < 200_000
