"""Recordings with faults: refused by name and line before anything is computed, and nothing is written."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.bad_input.conftest import Refused

Lines = list[str]
"""Of a good recording: the header, then a row every 0.01 s."""


def cell(line: str, column: int, value: str) -> str:
    cells = line.split(",")
    cells[column] = value
    return ",".join(cells)


def everywhere(column: int, value: str) -> Callable[[Lines], Lines]:
    return lambda lines: [lines[0], *(cell(line, column, value) for line in lines[1:])]


def once(column: int, value: str) -> Callable[[Lines], Lines]:
    return lambda lines: [*lines[:50], cell(lines[50], column, value), *lines[51:]]


def constant(lines: Lines) -> Lines:
    return everywhere(2, "1.0")(everywhere(1, "1.0")(lines))


BROKEN: dict[str, tuple[Callable[[Lines], Lines], str]] = {
    "empty": (lambda lines: [], "the file is empty or truncated"),
    "header only": (lambda lines: lines[:1], "the file is empty or truncated"),
    "no speed": (lambda lines: [line.rpartition(",")[0] for line in lines], "column speed_rad_s: missing"),
    "column twice": (
        lambda lines: [lines[0].replace("m2", "m1"), *lines[1:]],
        "line 1: column torque_m1_nm comes twice",
    ),
    "text": (once(1, "abc"), "line 51, column torque_m1_nm: expected a finite number or nan, got 'abc'"),
    "no time": (once(0, ""), "line 51, column time_s: expected a time greater than in the row before"),
    "infinite": (once(3, "inf"), "line 51, column speed_rad_s: expected a finite number or nan, got 'inf'"),
    "decimal comma": (once(3, '"1,5"'), "got '1,5'. Write decimals with a point"),
    "no measurement": (once(3, "1e200"), "got '1e+200'. Beyond 1e+30 nothing is a measurement"),
    "a cell too many": (once(3, "1.0,2.0"), "line 51: expected 4 cells as in the header, got 5"),
    "truncated": (lambda lines: [*lines[:50], lines[50][:6]], "line 51: expected 4 cells as in the header, got 2"),
    "time back": (once(0, "0.2"), "line 51, column time_s: expected a time greater than in the row before"),
    "rows left out": (lambda lines: lines[:50] + lines[60:], "line 51, column time_s: expected a uniform step"),
    "all nan": (everywhere(3, "nan"), "expected 10 usable samples or more, got 0 of 1500"),
    "too short": (lambda lines: lines[:6], "expected 10 usable samples or more, got 5 of 5"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_refused_by_line_and_nothing_is_written(refused: Refused, drive: Path, fault: str) -> None:
    change, said = BROKEN[fault]
    path = drive / "run_1.csv"
    path.write_text("".join(f"{line}\n" for line in change(path.read_text().splitlines())))
    complaint = refused("diagnose", path, "--model", drive / "drive.toml", "--out", drive / "out")
    assert f"{path}: " in complaint
    assert said in complaint
    assert not (drive / "out").exists()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("run.csv", b"\xff\xfet\0i\0", "the file is empty or truncated"),
        ("run.csv", "time_s,caf\u00e9\n".encode("latin-1"), "line 1: expected utf-8 text, got byte 0xe9"),
        ("run.csv", bytes(100), "the file is empty or truncated"),
        ("run.parquet", b"time_s,speed_rad_s\n", "a damaged or truncated one"),
        ("run.parquet", b"", "a damaged or truncated one"),
        ("run.mat", b"time_s,speed_rad_s\n", "a damaged or truncated one"),
        ("run.xlsx", b"PK", "a damaged or truncated one"),
        ("run.wav", b"RIFF", "expected a recording, got '.wav'. Save it as CSV, Parquet or MDF 4 where it was"),
        ("run", b"", "expected a recording, got 'no ending'. Save it as CSV"),
        (
            "run.out",
            b"t;u\n0;1\n",
            "expected a recording, got '.out'. It looks like text: copy it to a name that ends in",
        ),
        ("run.csv.gz", b"no gzip", "expected a whole file of gzip, got a damaged or truncated one"),
        (
            "run.json",
            b"{}",
            "expected the JSON of WPILib's SysId, whose tests have rows of 4 or 9 numbers, got another",
        ),
        ("run.wpilog", b"MDF", "expected a data log of WPILib, which begins with WPILOG, got b'MDF'"),
        ("run.ods", b"PK", "expected a whole OpenDocument workbook, got a damaged or truncated one"),
        ("run.arrow", b"ARROW1", "expected a whole Arrow file, got a damaged or truncated one"),
    ],
)
def test_what_is_no_recording_is_refused(
    refused: Refused, tmp_path: Path, name: str, content: bytes, said: str
) -> None:
    (tmp_path / name).write_bytes(content)
    assert said in refused("identify", tmp_path / name, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("command", "change", "said"),
    [
        ("diagnose", constant, "the torque is constant at 2, expected it to vary"),
        ("diagnose", lambda lines: lines[:100], "99 good samples, expected at least 200"),
        ("identify", constant, "the torque excites 0 parameters, expected 8"),
        ("identify", lambda lines: lines[:40], "good samples, expected at least 80"),
        (
            "identify",
            lambda lines: [lines[0], *(cell(line, 0, f"{0.013 * row:.6f}") for row, line in enumerate(lines[1:]))],
            "sampled every 0.013 s, expected a whole fraction of the models' period 0.02 s",
        ),
    ],
)
def test_what_carries_no_answer_is_refused(
    refused: Refused, drive: Path, command: str, change: Callable[[Lines], Lines], said: str
) -> None:
    path = drive / "run_1.csv"
    path.write_text("".join(f"{line}\n" for line in change(path.read_text().splitlines())))
    model = drive / "drive.toml"
    complaint = refused(command, path, "--model", model, "--out", drive / "out")
    assert complaint.startswith("error: recording run_1: ")
    assert said in complaint
    assert not (drive / "out").exists()
