"""Text of other people, without what would steer a terminal or begin a new line of a file."""

from __future__ import annotations


def printable(text: str) -> str:
    """Put a dot in place of each character that would do something instead of being seen."""
    return "".join(letter if letter.isprintable() else "·" for letter in text)
