"""What a reader must know of a file where the file does not tell it: ``[signals] format``."""

from __future__ import annotations

import codecs
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator


class FormatHints(BaseModel):
    """How a text recording is written; what is left out is recognised.

    Attributes
    ----------
    delimiter : str
        One character between cells; empty to recognise it, a blank for any number of blanks.
    decimal : str
        Decimal mark; empty to recognise it.
    encoding : str
        Name of the text encoding, as Python knows it; a byte order mark is recognised in any case.
    header_line : int, optional
        Line of the column names, from 1; 0 where there is none: the columns are called 1, 2, 3 and so on.
    units_line : int, optional
        Line of the units, from 1; 0 where there is none.
    skip_lines : int
        Lines at the beginning that are not looked at.
    comment : str
        What a line that is no row begins with; empty to recognise it, where the header line is not set.
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    delimiter: str = Field(default="", max_length=1)
    decimal: Literal["", ".", ","] = ""
    encoding: str = "utf-8"
    header_line: int | None = Field(default=None, ge=0)
    units_line: int | None = Field(default=None, ge=0)
    skip_lines: int = Field(default=0, ge=0)
    comment: str = Field(default="", max_length=8)

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
