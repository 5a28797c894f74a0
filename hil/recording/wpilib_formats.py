"""Logs of WPILib: a robot's data log (.wpilog), and what SysId kept of its four tests (.json).

The data log is "WPILib Data Log File Format Specification", version 1.0: a header, then records of an entry's number, a
moment in microseconds and a value; records of entry 0 say what the others are called. Each entry has times of its own.
A SysId file holds rows of [time, voltage, position, velocity] for each test, of a drivetrain both sides and the gyro.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from hil.errors import RecordingError
from hil.recording.bounds import damaged, require_cells
from hil.recording.measurement_formats import Group, table_of, tables_of
from hil.recording.request import Request
from hil.recording.table import Table, as_column, as_text

MAGIC: Final = b"WPILOG"
US: Final = 1e-6

NUMBERS: Final = {"boolean": "?", "int64": "<i8", "float": "<f4", "double": "<f8"}
"""Types of entries that are numbers, and how NumPy reads one; [] behind it is an array of them."""

COLUMNS: Final = {
    4: ("time_s", "voltage", "position", "velocity"),
    9: (
        "time_s",
        *("left_voltage", "right_voltage", "left_position", "right_position"),
        *("left_velocity", "right_velocity", "gyro_angle", "gyro_rate"),
    ),
}
"""What the numbers of a row of SysId are, by how many there are."""

UNITS: Final = {"rotations": "rev", "radians": "rad", "degrees": "deg", "meters": "m", "feet": "ft", "inches": "in"}


def read(path: Path, request: Request) -> Table:
    """Read the entries of a data log asked for, or those that share the time of most."""
    return table_of(path, data_log(path), (), request)


def read_all(path: Path, request: Request) -> list[Table]:
    """Read all entries of a data log, a table for each time."""
    return tables_of(path, data_log(path), (), request)


def data_log(path: Path) -> list[Group]:
    """Read the numbers of a data log, entry by entry; of one that is cut, as at a brownout, its whole records."""
    content = path.read_bytes()
    if content[:6] != MAGIC or len(content) < 12:
        raise RecordingError(path, f"expected a data log of WPILib, which begins with WPILOG, got {content[:6]!r}")
    (extra,) = struct.unpack_from("<I", content, 8)
    names: dict[int, tuple[str, str]] = {}
    rows: dict[int, list[tuple[int, bytes]]] = {}
    for entry, stamp, value in _records(content, 12 + extra):
        if entry == 0:
            _control(value, names)
        elif names.get(entry, ("", ""))[1].removesuffix("[]") in NUMBERS:
            rows.setdefault(entry, []).append((stamp, value))
    require_cells(path, sum(map(len, rows.values())))
    start = min((stamps[0][0] for stamps in rows.values()), default=0)
    return [_group(*names[entry], values, start) for entry, values in rows.items()]


def _records(content: bytes, at: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield entry, moment [us] and value of each whole record."""
    while at < len(content):
        sizes = content[at]
        ends = [at + 1]
        for size in ((sizes & 3) + 1, (sizes >> 2 & 3) + 1, (sizes >> 4 & 7) + 1):
            ends.append(ends[-1] + size)
        entry, length, stamp = (int.from_bytes(content[a:b], "little") for a, b in pairwise(ends))
        at = ends[-1] + length
        if at > len(content):
            return
        yield entry, stamp, content[ends[-1] : at]


def _control(value: bytes, names: dict[int, tuple[str, str]]) -> None:
    """Take note of what an entry is called, and of which type it is, where the record begins one."""
    if len(value) < 13 or value[0] != 0:
        return
    (entry,) = struct.unpack_from("<I", value, 1)
    texts, at = [], 5
    for _ in range(2):
        (length,) = struct.unpack_from("<I", value, at)
        texts.append(value[at + 4 : at + 4 + length].decode("utf-8", "replace"))
        at += 4 + length
    names[entry] = (texts[0].strip("/"), texts[1])


def _group(name: str, kind: str, values: list[tuple[int, bytes]], start: int) -> Group:
    of_one = np.dtype(NUMBERS[kind.removesuffix("[]")])
    width = max(len(value) // of_one.itemsize for _, value in values)
    table = np.full((len(values), width), np.nan)
    for row, (_, value) in enumerate(values):
        found = np.frombuffer(value[: len(value) // of_one.itemsize * of_one.itemsize], of_one)
        table[row, : found.size] = found
    group = Group(np.array([(stamp - start) * US for stamp, _ in values]))
    for k in range(width):
        group.channels[f"{name}[{k}]" if kind.endswith("[]") else name] = as_column(table[:, k])
    return group


def sysid(path: Path, request: Request) -> Table:
    """Read the four tests of SysId in the order of their times, each row with its test's name."""
    try:
        document: Any = json.loads(path.read_text("utf-8"))
        tests = {name: np.array(rows, np.float64) for name, rows in _tests(document) if rows}
    except (ValueError, TypeError, RecursionError) as error:
        raise damaged(path, "the JSON that SysId writes", error) from error
    widths = {rows.shape[-1] if rows.ndim == 2 else 0 for rows in tests.values()}
    if len(widths) != 1 or not widths <= COLUMNS.keys():
        raise RecordingError(
            path,
            "expected the JSON of WPILib's SysId, whose tests have rows of 4 or 9 numbers, got another. Save the data "
            "as CSV, or as lines of JSON (.jsonl) with an object for each row.",
        )
    ordered = sorted(tests.items(), key=lambda each: float(each[1][0, 0]))
    rows = np.concatenate([rows for _, rows in ordered])
    require_cells(path, rows.size)
    names = COLUMNS[rows.shape[1]]
    unit = UNITS.get(str(document.get("units", "")).lower(), "")
    units = {"position": unit, "velocity": f"{unit}/s"} if unit else {}
    columns = dict(zip(names, map(as_column, rows.T), strict=True))
    columns["test"] = as_text([name for name, rows in ordered for _ in range(len(rows))])
    found = {name: units[key] for name in names for key in units if name.endswith(key)}
    found |= {name: "V" for name in names if name.endswith("voltage")}
    return Table(path, columns, {"time_s": "s", **found}, remarks=("tests of SysId, one after the other",))


def _tests(document: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(document, dict):
        yield from ((name, rows) for name, rows in document.items() if isinstance(rows, list))
