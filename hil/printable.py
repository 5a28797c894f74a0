"""Text of other people, with what would steer a terminal shown instead of done."""

from __future__ import annotations

from typing import Final

_KEPT: Final = "\n\t\xa0"


def shown(text: str) -> str:
    """Show control characters (ESC as its code) and those that turn or hide text; line ends and tabs stay."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(letter if _is_plain(letter) else _as_code(letter) for letter in text)


def printable(text: str) -> str:
    """Put a dot in place of each character that would do something instead of being seen, line ends too."""
    return "".join(letter if letter.isprintable() else "·" for letter in text)


def _is_plain(letter: str) -> bool:
    return letter in _KEPT or letter.isprintable()


def _as_code(letter: str) -> str:
    number = ord(letter)
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"
