"""What a reader must be told of a file where the file does not tell it: ``[signals] format``."""

from __future__ import annotations

import codecs

from pydantic import BaseModel, ConfigDict, Field, field_validator


class FormatHints(BaseModel):
    """How a text recording is written.

    Attributes
    ----------
    delimiter : str
        One character between cells; empty to read it off the header.
    encoding : str
        Name of the text encoding, as Python knows it.
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    delimiter: str = Field(default="", max_length=1)
    encoding: str = "utf-8"

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
            codecs.lookup(encoding)
        except LookupError:
            raise ValueError("a text encoding such as 'utf-8' or 'latin-1'") from None
        return encoding
