"""The form of a text file, recognised from its lines: separator, decimal sign, comments, names, units, rows."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from hil.recording.bounds import COLUMNS
from hil.recording.request import FormatHints
from hil.recording.scales import unit_in, unit_of

MISSING: Final = ("", "NA", "N/A", "#N/A", "n/a", "null", "NULL")
"""Cells that say that nothing was read, in addition to nan in any spelling."""

NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:inf|infinity)", re.IGNORECASE)

DATE_TIME: Final = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d{1,9})?)?(?:Z|[+-]\d\d:?\d\d)?")
"""A date with a time of day (ISO 8601)."""

COMMA, TAB, BLANKS = ",", "\t", " "

DELIMITER_WORDS: Final[Mapping[str, str]] = {TAB: "a tab", BLANKS: "blanks", COMMA: "a comma", ";": "a semicolon"}

SAMPLE_LINES: Final = 200
"""Lines that are looked at: more than any header has, and enough rows to tell what a column holds."""

MOST_CELLS: Final = 100_000  # cells that are looked at: of a hundred columns those of all lines

DELIMITERS: Final = (COMMA, ";", TAB, "|", BLANKS)
DECIMALS: Final = (".", ",")

COMMENTS: Final = ("#", "%", "//")

NAMES_THE_DELIMITER: Final = "sep="  # first line of a file that Excel shall read

TYPE_WORDS: Final = frozenset(
    "f4 f8 i1 i2 i4 i8 u1 u2 u4 u8 b float double single real int integer uint bool boolean string text".split()
)
"""Words of a line of data types, as INCA and others write one."""

HALF: Final = 0.5  # share of the cells of rows that are no texts, in most files


class CellKind(Enum):
    """What a cell alone says of itself."""

    MISSING = "missing"
    NUMBER = "number"
    DATE_TIME = "date_time"
    TEXT = "text"


def kind_of(cell: str, decimal: str = ".") -> CellKind:
    """Tell what a cell is, given the decimal mark; ``nan`` and empty ones are missing."""
    plain = cell.strip()
    if plain in MISSING or plain.lower() == "nan":
        return CellKind.MISSING
    if decimal == ",":
        plain = plain.replace(".", "_").replace(",", ".")
    if NUMBER.fullmatch(plain):
        return CellKind.NUMBER
    return CellKind.DATE_TIME if DATE_TIME.fullmatch(cell.strip()) else CellKind.TEXT


@dataclass(frozen=True, slots=True)
class TextForm:
    """How the lines of a text recording become rows; lines count from 1, 0 is none."""

    names: tuple[str, ...]  # none twice
    delimiter: str = COMMA  # between cells; `BLANKS` stands for any number of them
    decimal: str = "."  # mark, "." or ","
    encoding: str = "utf-8"  # name of the text encoding, as Python knows it
    first_row_line: int = 2  # of the first row of data
    header_line: int = 1  # of the names; 0: columns are called 1, 2 and so on
    units_line: int = 0  # of the units, if they have a line
    units: Mapping[str, str] = field(default_factory=dict)  # by name of the column
    comment: str = ""  # what a line that is no row begins with
    trailing: bool = False  # every row ends in a delimiter
    repeated: tuple[str, ...] = ()  # names that the header has more than once

    @property
    def width(self) -> int:
        """Cells of a row."""
        return len(self.names) + self.trailing

    def said(self) -> Iterator[str]:
        """Say what a plain CSV file would not have, one part each."""
        between = DELIMITER_WORDS.get(self.delimiter, repr(self.delimiter))
        behind = max(self.header_line, self.units_line)
        parts = (
            (self.encoding not in ("utf-8", "utf-8-sig"), f"{self.encoding} text"),
            (self.delimiter != COMMA and len(self.names) > 1, f"{between} between cells"),
            (self.decimal == ",", "decimal comma"),
            (self.header_line == 0, f"no line of names: columns are called 1 to {len(self.names)}"),
            (self.header_line > 1, f"names in line {self.header_line}"),
            (self.units_line > 0, f"units in line {self.units_line}"),
            (self.first_row_line > behind + 1, f"rows from line {self.first_row_line}"),
            (bool(self.comment), f"lines that begin with {self.comment} are comments"),
            (self.trailing, "a delimiter ends every row"),
            (bool(self.repeated), f"{', '.join(self.repeated)} more than once, numbered"),
        )
        return (text for holds, text in parts if holds)


def split(line: str, delimiter: str) -> list[str]:
    """Cut one line into cells; none where it can't be cut."""
    try:
        if delimiter == BLANKS:
            return line.split()
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return []


@dataclass(frozen=True, slots=True)
class _Line:
    """One line that is neither empty nor a comment: its number from 1, its cells and what each of them is."""

    number: int
    cells: list[str]
    kinds: list[CellKind]

    def has(self, *kinds: CellKind) -> bool:
        return any(kind in kinds for kind in self.kinds)

    @property
    def is_data(self) -> bool:
        return self.has(CellKind.NUMBER, CellKind.DATE_TIME)


@dataclass(frozen=True, slots=True)
class _Cut:
    """The lines cut under one delimiter and decimal mark."""

    delimiter: str
    decimal: str
    lines: list[_Line]

    @property
    def width(self) -> int:
        """Cells of most lines with data; the first of equals."""
        rows = [line for line in self.lines if line.is_data] or self.lines
        return Counter(len(line.cells) for line in rows).most_common(1)[0][0] if rows else 0

    @property
    def rank(self) -> tuple[bool, bool, bool, float, int]:
        """How well the pair fits: most cells numbers, a line of names, several columns; then how many of both."""
        width = self.width
        rows = [line for line in self.lines if line.is_data]
        cells = sum(len(line.cells) for line in rows)
        read = sum(kind is not CellKind.TEXT for line in rows if len(line.cells) == width for kind in line.kinds)
        head = [line for line in self.lines if not line.is_data]
        named = not head or any(self.names_all(line, width) for line in head)
        share = round(read / cells, 2) if cells else 0.0
        return share >= HALF, named, width > 1, share, width

    def names_all(self, line: _Line, width: int) -> bool:
        """Tell whether a line has a text for every column, but for what may follow a delimiter at the end."""
        if len(line.cells) == width:
            return all(line.cells[1:-1]) and any(line.cells)  # an index has no name where pandas writes one
        if len(line.cells) == width + 1:
            return all(line.cells[:-1]) and not line.cells[-1]
        rows = [other for other in self.lines if other.is_data and len(other.cells) == width]
        return len(line.cells) == width - 1 > 0 and all(line.cells) and all(not other.cells[-1] for other in rows)


def recognise(lines: Sequence[str], hints: FormatHints) -> TextForm:
    """Tell how the first lines of a text recording are written; what the hints give is not looked for."""
    skipped = hints.skip_lines
    delimiter = hints.delimiter
    if len(lines) > skipped and lines[skipped].strip().lower().startswith(NAMES_THE_DELIMITER):
        delimiter = delimiter or lines[skipped].strip()[len(NAMES_THE_DELIMITER) :][:1] or TAB
        skipped += 1
    comment = hints.comment or (_comment_of(lines[skipped:]) if hints.header_line is None else "")
    pairs = [
        (one, decimal)
        for one in ([delimiter] if delimiter else DELIMITERS)
        for decimal in ([hints.decimal] if hints.decimal else DECIMALS)
        if one != decimal
    ] or [(delimiter, ".")]
    cuts = [_cut(lines, skipped, comment, *pair) for pair in pairs]
    best = max(cuts, key=lambda cut: cut.rank)  # the first of equals
    return _formed(best, lines, hints, comment, skipped)


def _comment_of(lines: Sequence[str]) -> str:
    """Return what the first line that is not empty begins with, where that marks a comment."""
    first = next((line.strip() for line in lines if line.strip()), "")
    return next((mark for mark in COMMENTS if first.startswith(mark)), "")


def _cut(lines: Sequence[str], skipped: int, comment: str, delimiter: str, decimal: str) -> _Cut:
    found: list[_Line] = []
    looked_at = 0
    for number, line in enumerate(lines[skipped:], start=skipped + 1):
        if not line.strip() or (comment and line.lstrip().startswith(comment)):
            continue
        cells = [cell.strip() for cell in split(line, delimiter)[: COLUMNS + 1]]
        looked_at += len(cells)
        if looked_at > MOST_CELLS and found:
            break
        found.append(_Line(number, cells, [kind_of(cell, decimal) for cell in cells]))
    return _Cut(delimiter, decimal, found)


def _formed(cut: _Cut, lines: Sequence[str], hints: FormatHints, comment: str, skipped: int) -> TextForm:
    """Put the parts together: where names, units and rows are, and what the columns are called."""
    width = cut.width
    header = _header(cut, width, hints)
    at = 0 if header is None else header.number
    between = [line for line in cut.lines if line.number > at and line.number != hints.units_line]
    is_set = hints.header_line == 0 or (hints.header_line is not None and hints.units_line is not None)
    rows = between if is_set else _without_preamble(between)
    first = rows[0].number if rows else max(at, hints.units_line or 0) + 1
    names = [] if header is None else list(header.cells)
    if header is None and hints.header_line is None and (names := _names_in_comment(lines, first, comment, cut, width)):
        at = first - 1
    trailing = _is_trailing(rows, names, width)
    if names and not names[-1] and (trailing or len(names) == width + 1):
        names.pop()
    called, repeated = _numbered(names or [str(number) for number in range(1, width - trailing + 1)])
    above = [line for line in cut.lines if line.number < at and len(line.cells) == width and _are_all_units(line)]
    units_at = hints.units_line if hints.units_line is not None else _units_line([*above[-1:], *between], first)
    return TextForm(
        names=tuple(called),
        delimiter=cut.delimiter,
        decimal=cut.decimal,
        first_row_line=first,
        header_line=at,
        units_line=units_at,
        units=_units(
            called, names or called, next((line.cells for line in _all(cut, lines) if line.number == units_at), [])
        ),
        comment=comment,
        trailing=trailing,
        repeated=tuple(repeated),
    )


def _all(cut: _Cut, lines: Sequence[str]) -> list[_Line]:
    """Return the lines of a cut, and those skipped: units may be set by hand to one of them."""
    known = {line.number for line in cut.lines}
    return cut.lines + [
        _Line(number, [cell.strip() for cell in split(line, cut.delimiter)], [])
        for number, line in enumerate(lines, start=1)
        if number not in known
    ]


def _header(cut: _Cut, width: int, hints: FormatHints) -> _Line | None:
    """Return the line of the names; None where there is none."""
    if hints.header_line is not None:
        return next((line for line in cut.lines if line.number == hints.header_line), None)
    if not cut.lines or (_is_row(cut.lines[0], cut, width) and not cut.lines[0].has(CellKind.TEXT)):
        return None
    strict, loose = None, None
    for line, after in zip(cut.lines, [*cut.lines[1:], None], strict=True):
        is_named = not line.is_data or (after is not None and _are_all_units(after) and line.has(CellKind.TEXT))
        if not is_named or not cut.names_all(line, width) or _is_above_the_names(line, after, width):
            continue
        behind = _without_preamble([other for other in cut.lines if other.number > line.number])
        if not behind or len(behind[0].cells) != width:
            continue
        if _is_row(behind[0], cut, width):
            strict = strict or line
        elif behind[0].is_data:
            loose = loose or line
    return strict or loose or cut.lines[0]


def _is_row(line: _Line, cut: _Cut, width: int) -> bool:
    """Tell whether a line has data in it, and no text where the rows after it have numbers."""
    if len(line.cells) != width or not line.is_data:
        return False
    after = [other for other in cut.lines if other.number > line.number and len(other.cells) == width]
    for column, kind in enumerate(line.kinds):
        if (
            kind is CellKind.TEXT
            and after
            and 2 * sum(o.kinds[column] is not CellKind.TEXT for o in after) > len(after)
        ):
            return False
    return True


def _without_preamble(lines: list[_Line]) -> list[_Line]:
    """Leave out, at the beginning, units and words for data types that rows of data follow."""
    first = 0
    while any(line.is_data for line in lines[first + 1 : first + 3]) and _is_preamble(lines[first]):
        first += 1
    return lines[first:]


def _is_preamble(line: _Line) -> bool:
    return _are_units(line) or _are_types(line)


def _are_units(line: _Line) -> bool:
    """Tell whether a line is one of units: no data in it, and one of a quantity at least that is known here."""
    return not line.is_data and any(unit_of(cell) is not None for cell in line.cells if cell not in ("", "-"))


def _are_all_units(line: _Line) -> bool:
    return not line.is_data and bool(line.cells) and all(unit_of(cell) is not None for cell in line.cells)


def _is_above_the_names(line: _Line, after: _Line | None, width: int) -> bool:
    """Tell whether a line holds the units of the names that stand in the next."""
    if after is None or after.is_data or len(after.cells) != width or not all(after.cells):
        return False
    return _are_all_units(line) and not _are_all_units(after)


def _are_types(line: _Line) -> bool:
    return all(cell.lower() in TYPE_WORDS for cell in line.cells if cell) and any(line.cells)


def _units_line(lines: list[_Line], first: int) -> int:
    return next((line.number for line in lines if line.number < first and _are_units(line)), 0)


def _names_in_comment(lines: Sequence[str], first: int, comment: str, cut: _Cut, width: int) -> list[str]:
    """Return the names that the comment right before the rows holds, as NumPy writes them."""
    line = lines[first - 2].strip() if comment and first >= 2 else ""
    names = [cell.strip() for cell in split(line.removeprefix(comment), cut.delimiter)]
    fits = line.startswith(comment) and len(names) == width and all(names)
    return names if fits and not any(kind_of(name) is CellKind.NUMBER for name in names) else []


def _is_trailing(rows: list[_Line], names: list[str], width: int) -> bool:
    """Tell whether every row ends in a delimiter that no column follows."""
    ends = [not line.cells[-1] for line in rows if len(line.cells) == width and line.cells]
    return width > 1 and bool(ends) and all(ends) and (len(names) < width or not names or not names[-1])


def _numbered(names: list[str]) -> tuple[list[str], list[str]]:
    """Return names, those numbered that come more than once: which of them is meant is not for us to say."""
    count = Counter(names)
    repeated = [name for name, times in count.items() if name and times > 1]
    seen: Counter[str] = Counter()
    called = []
    for name in names:
        seen[name] += 1
        called.append(f"{name} ({seen[name]})" if name in repeated else name)
    return called, repeated


def _units(names: list[str], written: list[str], cells: list[str]) -> dict[str, str]:
    """Return the unit of each column: of the line of units; of a numbered name the one that it ends in as written."""
    listed = {name: cell.strip("[]() ") for name, cell in zip(names, cells, strict=False) if cell.strip("[]() ")}
    named = {name: unit_in(text) for name, text in zip(names, written, strict=False) if name != text}
    return {name: unit for name in names if (unit := listed.get(name) or named.get(name, ""))}
