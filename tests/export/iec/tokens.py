"""Structured Text in tokens: comments gone, keywords and names told apart, every token with its line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

KEYWORDS = frozenset(
    """FUNCTION_BLOCK END_FUNCTION_BLOCK VAR VAR_INPUT VAR_OUTPUT CONSTANT END_VAR ARRAY OF IF THEN ELSIF ELSE END_IF
    FOR TO BY DO END_FOR EXIT AND OR NOT TRUE FALSE BOOL INT DINT REAL LREAL""".split()
)

RESERVED = frozenset(
    """ACTION CASE CONFIGURATION DATE DT END_CASE END_REPEAT END_WHILE EN ENO F_EDGE FUNCTION INITIAL_STEP INTERVAL LD
    LINT MOD N ON PRIORITY PROGRAM R R_EDGE READ_ONLY READ_WRITE REPEAT RESOURCE RETAIN RETURN S SINGLE SINT ST STEP
    STRING STRUCT TASK TIME TOD TRANSITION TYPE UDINT UINT ULINT UNTIL USINT VAR_ACCESS VAR_EXTERNAL VAR_GLOBAL
    VAR_IN_OUT VAR_TEMP WHILE WITH WORD XOR BYTE DWORD LWORD D L P SD DS SL CAL JMP RET ADD SUB MUL DIV GT GE EQ NE
    LE LT METHOD CLASS INTERFACE NAMESPACE PROPERTY THIS SUPER ABSTRACT FINAL OVERRIDE PUBLIC PRIVATE""".split()
)
"""Words of the standard (edition 2 with its instruction list and SFC qualifiers, edition 3) no name may be."""

_TOKEN = re.compile(
    r"""(?P<space>\s+)|(?P<comment>\(\*.*?\*\))|(?P<real>\d+\.\d+(?:E[+-]?\d+)?)|(?P<int>\d+)|(?P<word>[A-Za-z_]\w*)
    |(?P<mark>:=|\.\.|<=|>=|<>|[-+*/=<>()\[\],;:.])""",
    re.X | re.S,
)


class NotStructuredText(Exception):
    """The text is outside the subset that is translated; says where."""


@dataclass(frozen=True, slots=True)
class Token:
    """``kind`` is keyword, name, real, int or mark; keywords are in capitals."""

    kind: str
    text: str
    line: int


def tokens(text: str) -> Iterator[Token]:
    """Split a text; nothing in it is skipped but space and comments."""
    place, line = 0, 1
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            raise NotStructuredText(f"line {line}: {text[place : place + 20]!r}")
        kind = str(match.lastgroup)
        if kind == "word":
            yield _word(match.group(), line)
        elif kind not in ("space", "comment"):
            yield Token(kind, match.group(), line)
        line += match.group().count("\n")
        place = match.end()


def _word(text: str, line: int) -> Token:
    if text.upper() in KEYWORDS:
        return Token("keyword", text.upper(), line)
    if text.upper() in RESERVED:
        raise NotStructuredText(f"line {line}: {text} is a word of the standard, not a name")
    return Token("name", text, line)
