"""How a text recording is written: what was recognised, or set by hand, as a value that can be printed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

COMMA, TAB, BLANKS = ",", "\t", " "

DELIMITER_WORDS: Final[Mapping[str, str]] = {TAB: "a tab", BLANKS: "blanks", COMMA: "a comma", ";": "a semicolon"}


@dataclass(frozen=True, slots=True)
class TextForm:
    """How the lines of a text recording become rows.

    Attributes
    ----------
    names : tuple of str
        Of the columns, none twice.
    delimiter, decimal, encoding : str
        As in `hil.recording.format_hints`.
    first_row_line : int
        Line of the first row, from 1.
    header_line, units_line : int
        Lines of names and units; 0 where there is none.
    units : mapping of name to str
        Of the columns that have one.
    comment : str
        What a line that is no row begins with; empty where none does.
    trailing : bool
        Whether every row ends in a delimiter.
    repeated : tuple of str
        Names that the header has more than once.
    """

    names: tuple[str, ...]
    delimiter: str = COMMA
    decimal: str = "."
    encoding: str = "utf-8"
    first_row_line: int = 2
    header_line: int = 1
    units_line: int = 0
    units: Mapping[str, str] = field(default_factory=dict)
    comment: str = ""
    trailing: bool = False
    repeated: tuple[str, ...] = ()

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
