"""The bytes of a text file as text: a byte order mark says how, else what was set by hand does, else it is UTF-8."""

from __future__ import annotations

import codecs
from pathlib import Path
from typing import Final

from hil.errors import RecordingError

MARKS: Final = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # begins like that of UTF-16
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte order marks (Unicode 15, 23.8) and the encoding that reads them."""

WITHOUT_MARK: Final = ((1, "utf-16-le"), (0, "utf-16-be"))
"""UTF-16 without a mark: of ASCII every second byte is NUL, from this one on."""

LOOKED_AT_BYTES: Final = 64
"""Enough for the names of a column or two."""

FALLBACK: Final = "latin-1"
"""What a file that is no UTF-8 most likely is: of a Windows program, whose other characters are in no unit."""


def encoding_of(content: bytes, given: str) -> str:
    """Return how a file is encoded, as far as it tells, else ``given``."""
    for mark, name in MARKS:
        if content.startswith(mark):
            return name
    start = content[:LOOKED_AT_BYTES]
    start = start[: len(start) // 2 * 2]
    for first, name in WITHOUT_MARK:
        if len(start) >= 4 and not any(start[first::2]) and all(start[1 - first :: 2]):
            return name
    return given


def decoded(path: Path, content: bytes, given: str) -> tuple[str, str]:
    """Return a file's text with line feeds only and no empty lines at the end, and its encoding."""
    encoding = encoding_of(content, given)
    try:
        text = content.decode(encoding)
    except UnicodeError as error:
        start = error.start if isinstance(error, UnicodeDecodeError) else 0
        line = content.count(b"\n", 0, start) + 1
        byte = content[start : start + 1].hex()
        raise RecordingError(
            path,
            f"line {line}: expected {encoding} text, got byte 0x{byte}. Give its encoding in the model file: "
            f'[signals] format = {{ encoding = "{FALLBACK}" }}.',
        ) from error
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return lines.rstrip("\n"), encoding


def likely_encoding(content: bytes) -> str:
    """Return the encoding to try: what the file tells, else UTF-8 where it is some, else `FALLBACK`."""
    encoding = encoding_of(content, "utf-8")
    try:
        content.decode(encoding)
    except UnicodeError:
        return FALLBACK
    return encoding
