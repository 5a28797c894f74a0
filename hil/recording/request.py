"""What is asked of a recording: in which form it is read, and which of its channels are to be brought together."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, field_validator

from hil.recording.table import Column, is_column

MOST_SLICES: Final = 512  # columns of a matrix that have an address each

_SLICE: Final = re.compile(r"(?P<open>[\[(])\s*(?P<row>:|\d+)\s*,\s*(?P<column>:|\d+)\s*[\])]")


class FormatHints(BaseModel):
    """How a text recording is written; what is left out is recognised."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    delimiter: str = Field(default="", max_length=1)  # one character between cells
    decimal: Literal["", ".", ","] = ""  # decimal mark
    encoding: str = "utf-8"  # name of the text encoding, as Python knows it
    header_line: int | None = Field(default=None, ge=0)  # line of the column names, from 1; 0 where there is none
    units_line: int | None = Field(default=None, ge=0)  # line of the units, from 1; 0 where there is none
    skip_lines: int = Field(default=0, ge=0)  # lines at the beginning that are not looked at
    comment: str = Field(default="", max_length=8)  # what a line that is no row begins with

    @field_validator("delimiter")
    @classmethod
    def _separates(cls, delimiter: str) -> str:
        if delimiter and (delimiter in "\"'\r\n.-+" or delimiter.isalnum()):
            raise ValueError("a character that can't be part of a number or a quote, such as ',' or ';'")
        return delimiter

    @field_validator("encoding")
    @classmethod
    def _is_known(cls, encoding: str) -> str:
        try:
            known = codecs.lookup(encoding)
        except LookupError:
            raise ValueError("a text encoding such as 'utf-8' or 'latin-1'") from None
        if not getattr(known, "_is_text_encoding", True):
            raise ValueError("a text encoding such as 'utf-8' or 'latin-1'")
        return encoding


@dataclass(frozen=True, slots=True)
class Request:
    """What a reader has to know in addition to the file."""

    form: FormatHints = field(default_factory=FormatHints)  # of a text recording
    columns: tuple[str, ...] = ()  # needed, by name or address in the file; empty for those that belong together
    time: str | None = None  # column of times, by name or address; None: none is asked for
    held: tuple[str, ...] = ()  # of them, those whose last value counts until the next; others lie on straight lines
    resample_s: float | None = None  # to which channels of different rates are brought
    dbc: Path | None = None  # what the frames of a logged CAN bus mean

    @property
    def names(self) -> tuple[str, ...]:
        """All channels that are needed, the time included."""
        return self.columns if self.time is None else (self.time, *self.columns)

    def as_document(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        document: dict[str, Any] = TypeAdapter(Request).dump_python(self, mode="json")
        return document | {"dbc": None if self.dbc is None else str(self.dbc.absolute())}

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Request:
        """Return what `as_document` was made of."""
        return TypeAdapter(Request).validate_python(document)


def canonical(address: str) -> str:
    """Return an address as it is listed: counted from 1, without blanks around its parts."""

    def counted(match: re.Match[str]) -> str:
        more = 1 if match["open"] == "[" else 0
        row, column = (part if part == ":" else str(int(part) + more) for part in (match["row"], match["column"]))
        return f"({row},{column})"

    return _SLICE.sub(counted, address.strip())


def vectors_of(name: str, values: Column) -> Iterator[tuple[str, Column]]:
    """Yield the vectors of an array with their addresses: the whole one, or a matrix's columns."""
    if not is_column(values) or values.size < 2:
        return
    if max(values.shape) == values.size:
        yield name, values.ravel()
    elif values.ndim == 2 and min(values.shape) <= MOST_SLICES:
        rows, columns = values.shape
        if rows >= columns:
            yield from ((f"{name}(:,{k + 1})", values[:, k]) for k in range(columns))
        else:
            yield from ((f"{name}({k + 1},:)", values[k, :]) for k in range(rows))


def under_names(vectors: Mapping[str, Column], wanted: Iterable[str]) -> dict[str, Column]:
    """Return vectors, those that are wanted by another spelling of their address under that one, too."""
    found = dict(vectors)
    found.update({name: vectors[canonical(name)] for name in wanted if canonical(name) in vectors})
    return found
