"""Channels as all formats hand them over: units that names give, and times in whatever form people write them.

A reader returns what its file holds. What a column means beyond that is understood here, once for every format: the
unit in a name (``n [1/min]``, ``n_rpm``), dates, times of day and durations as seconds since the first, day numbers of
a spreadsheet, and texts with a decimal comma. A recording of this program says all of it itself and is left as it is.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Final

import numpy as np

from hil.recording.scales import Quantity, unit_in, unit_of
from hil.recording.table import Column, ColumnKind, FloatArray, Table, as_column

DAY_S: Final = 86_400.0

SAMPLE_CELLS: Final = 20  # cells at the beginning of a column that tell what form all of it could have
DAY_NUMBERS: Final = (20_000.0, 80_000.0)  # 1954 to 2119 as a spreadsheet counts days (from 1899-12-30)

SHORTEST_STEP_S: Final = 2e-5
"""A step below it is no sampling period of a drive's logger in seconds, and can be one in days."""

_CLOCK: Final = r"(?P<h>\d{1,2}):(?P<min>\d\d)(?::(?P<s>\d\d(?:[.,]\d{1,9})?))?(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
_ZONE: Final = r"(?:Z|[+-]\d\d:?\d\d)?"
_ISO: Final = re.compile(rf"(?P<y>\d{{4}})[-/](?P<m>\d\d)[-/](?P<d>\d\d)(?:[T ]{_CLOCK})?\s*{_ZONE}")
_POINTS: Final = re.compile(rf"(?P<d>\d{{1,2}})\.(?P<m>\d{{1,2}})\.(?P<y>\d{{4}}|\d\d)(?:[T ,]+{_CLOCK})?")
_SLASHES: Final = re.compile(rf"(?P<a>\d{{1,2}})/(?P<b>\d{{1,2}})/(?P<y>\d{{4}}|\d\d)(?:[T ,]+{_CLOCK})?")
_TIME_OF_DAY: Final = re.compile(_CLOCK)
_DURATION: Final = re.compile(
    r"(?P<sign>-?)(?:(?P<days>\d+) days? ?,?)?\s*(?P<h>\d+):(?P<min>\d\d):(?P<s>\d\d(?:\.\d+)?)"
)
_WITH_UNIT: Final = re.compile(r"(?P<number>[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.,]+)")
_DECIMAL_COMMA: Final = re.compile(r"[+-]?(?:\d{1,3}(?:\.\d{3})+|\d*),\d+(?:[eE][+-]?\d+)?|[+-]?\d+")

Moment = Callable[[str], float]

_EPOCH: Final = datetime(1970, 1, 1)


def understood(table: Table) -> Table:
    """Return a table with the units of its columns, times as seconds, and texts of numbers as numbers."""
    columns, units = dict(table.columns), dict(table.units)
    remarks = list(table.remarks)
    for name, column in table.columns.items():
        if ColumnKind.of(column) is ColumnKind.TEXT and (read := numbers_of_texts(column)) is not None:
            columns[name], unit, remark = read
            remarks.append(f"{name}: {remark}")
            units.update({name: unit} if unit else {})
        elif not units.get(name) and (unit := unit_in(name)):
            units[name] = unit
        elif not units.get(name) and are_day_numbers(column):
            columns[name] = (column - column[0]) * DAY_S
            units[name] = "s"
            remarks.append(f"{name}: day numbers of a spreadsheet, read as seconds since the first")
    return replace(table, columns=columns, units=units, remarks=tuple(remarks))


def seconds_since_first(moments: Column) -> FloatArray:
    """Return NumPy's moments or durations as seconds, moments since the first of them; NaT is NaN."""
    ticks = moments.astype(f"{moments.dtype.kind}8[ns]")
    missing = np.isnat(ticks)
    since = ticks.astype(np.int64)
    if moments.dtype.kind == "M" and not missing.all():
        since = since - since[~missing][0]
    seconds: FloatArray = since.astype(np.float64) * 1e-9
    seconds[missing] = np.nan
    return seconds


def column_of(values: Column) -> Column:
    """Return any array as a column of a table: moments and durations as seconds, else one of the four kinds."""
    return seconds_since_first(values) if values.dtype.kind in "mM" else as_column(values)


def numbers_of_texts(column: Column) -> tuple[Column, str, str] | None:
    """Return a column of texts as numbers, their unit, and what was done; None where they are only texts."""
    texts: list[str] = [str(cell).strip() for cell in column.tolist()]
    first = [text for text in texts if text][:SAMPLE_CELLS]
    if not first:
        return None
    if (since := _iso_seconds(texts)) is not None:
        return since, "s", f"dates and times, read as seconds since {first[0]}"
    for form, moment in _moments(texts, first):
        if (seconds := _numbers(texts, moment)) is not None:
            start = first[0]
            if form == "durations":
                return seconds, "s", "durations, read as seconds"
            if form == "times of day":
                seconds = _over_midnight(seconds)
            return seconds - _first(seconds), "s", f"{form}, read as seconds since {start}"
    if (with_unit := _WITH_UNIT.fullmatch(first[0])) and unit_of(with_unit["unit"]) is not None:
        unit = with_unit["unit"]
        if (numbers := _numbers(texts, lambda text: _with_unit(text, unit))) is not None:
            return numbers, unit, f"numbers with the unit {unit} in each cell"
    if any("," in text for text in first) and (numbers := _numbers(texts, _decimal_comma)) is not None:
        return numbers, "", "numbers with a decimal comma"
    return None


def _iso_seconds(texts: Sequence[str]) -> FloatArray | None:
    """Return dates and times of one zone (ISO 8601) by NumPy, which takes a million of them; None where it can't."""
    first = next(text for text in texts if text)
    if _ISO.fullmatch(first) is None or "/" in first:
        return None
    found = re.search(r"(?:Z|[+-]\d\d:?\d\d)$", first[10:])
    zone = "" if found is None else found[0]
    if not all(text.endswith(zone) for text in texts if text):
        return None
    plain = [text.removesuffix(zone).strip().replace(",", ".") or "NaT" for text in texts]
    try:
        return seconds_since_first(np.array(plain, dtype="M8[ns]"))
    except ValueError:
        return None


def _moments(texts: Sequence[str], first: Sequence[str]) -> list[tuple[str, Moment]]:
    """Return the forms that the first cells could have, each with what turns a cell into seconds."""
    day_first = any(int(found["a"]) > 12 for text in texts if (found := _SLASHES.fullmatch(text)))
    forms: list[tuple[str, re.Pattern[str], Moment]] = [
        ("dates and times", _ISO, lambda text: _date(_ISO, text)),
        ("dates and times", _POINTS, lambda text: _date(_POINTS, text)),
        ("dates and times", _SLASHES, lambda text: _slashes(text, day_first)),
        ("times of day", _TIME_OF_DAY, _time_of_day),
        ("durations", _DURATION, _duration),
    ]
    return [(name, moment) for name, form, moment in forms if all(form.fullmatch(text) for text in first)]


def _numbers(texts: Sequence[str], number: Moment) -> FloatArray | None:
    """Return one number a cell, NaN for an empty one; None where one is of another form."""
    try:
        return np.array([number(text) if text else np.nan for text in texts])
    except (ValueError, TypeError, AttributeError):
        return None


def _first(seconds: FloatArray) -> float:
    return float(seconds[np.isfinite(seconds)][0])


def _clock_s(found: re.Match[str]) -> float:
    if found["h"] is None:
        return 0.0
    hour = int(found["h"])
    if found["half"]:
        hour = hour % 12 + 12 * (found["half"] in "pP")
    return 3600.0 * hour + 60.0 * int(found["min"]) + float((found["s"] or "0").replace(",", "."))


def _day_s(year: str, month: str, day: str) -> float:
    full = int(year) + (2000 if len(year) == 2 else 0)
    return (datetime(full, int(month), int(day)) - _EPOCH) / timedelta(seconds=1)


def _date(form: re.Pattern[str], text: str) -> float:
    found = _matched(form, text)
    zone = re.search(r"([+-])(\d\d):?(\d\d)$", text[10:])
    ahead_s = 0.0 if zone is None else float(f"{zone[1]}1") * (3600.0 * int(zone[2]) + 60.0 * int(zone[3]))
    return _day_s(found["y"], found["m"], found["d"]) + _clock_s(found) - ahead_s


def _slashes(text: str, day_first: bool) -> float:
    found = _matched(_SLASHES, text)
    month, day = (found["b"], found["a"]) if day_first else (found["a"], found["b"])
    return _day_s(found["y"], month, day) + _clock_s(found)


def _time_of_day(text: str) -> float:
    return _clock_s(_matched(_TIME_OF_DAY, text))


def _duration(text: str) -> float:
    found = _matched(_DURATION, text)
    seconds = DAY_S * int(found["days"] or 0) + 3600.0 * int(found["h"]) + 60.0 * int(found["min"]) + float(found["s"])
    return -seconds if found["sign"] else seconds


def _with_unit(text: str, unit: str) -> float:
    found = _matched(_WITH_UNIT, text)
    if found["unit"] != unit:
        raise ValueError(text)
    return float(found["number"].replace(",", "."))


def _decimal_comma(text: str) -> float:
    return float(_matched(_DECIMAL_COMMA, text)[0].replace(".", "").replace(",", "."))


def _matched(form: re.Pattern[str], text: str) -> re.Match[str]:
    found = form.fullmatch(text)
    if found is None:
        raise ValueError(text)
    return found


def _over_midnight(seconds: FloatArray) -> FloatArray:
    """Return times of day as times that continue after midnight."""
    steps = np.diff(seconds, prepend=seconds[:1])
    unrolled: FloatArray = seconds + DAY_S * np.cumsum(steps < -0.5 * DAY_S)
    return unrolled


def are_day_numbers(column: Column) -> bool:
    """Tell whether a column is a time in days, as spreadsheets keep it: by size, and a step too short in seconds."""
    if ColumnKind.of(column) is not ColumnKind.FLOAT or column.size < 3 or not np.isfinite(column).all():
        return False
    step = float(np.median(np.diff(column)))
    low, high = DAY_NUMBERS
    in_range = bool(low <= column.min() and column.max() <= high)
    return in_range and bool((np.diff(column) >= 0.0).all()) and 0.0 < step < SHORTEST_STEP_S


def is_even_time(column: Column) -> bool:
    """Tell whether numbers rise as times do: always, by equal steps, and not as the numbers of rows."""
    if ColumnKind.of(column) in (ColumnKind.TEXT, ColumnKind.BOOLEAN) or column.size < 3:
        return False
    numbers = column.astype(np.float64)
    steps = np.diff(numbers)
    step = float(np.median(steps))
    even = bool(np.isfinite(numbers).all() and step > 0.0 and (np.abs(steps - step) <= 0.05 * step).all())
    return even and not are_row_numbers(numbers)


def are_row_numbers(column: Column) -> bool:
    """Tell whether numbers count rows, from 0 or 1."""
    numbers = column.astype(np.float64)
    return bool(numbers.size > 1 and numbers[0] in (0.0, 1.0) and (np.diff(numbers) == 1.0).all())


def time_quantity(unit: str) -> bool:
    """Tell whether a unit is one of time; an empty or unknown one is not."""
    known = unit_of(unit) if unit else None
    return known is not None and known.quantity is Quantity.TIME
