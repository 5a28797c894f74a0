"""Structured Text in tokens: comments gone, keywords and names distinguished, every token with its line.

Source: IEC 61131-3, edition 2, annex B.1 (letters, digits and identifiers; constants) and annex C (reserved words).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

KEYWORDS = frozenset(
    """FUNCTION_BLOCK END_FUNCTION_BLOCK PROGRAM END_PROGRAM TYPE END_TYPE VAR VAR_INPUT VAR_OUTPUT CONSTANT END_VAR
    ARRAY OF IF THEN ELSIF ELSE END_IF FOR TO BY DO END_FOR WHILE END_WHILE EXIT AND OR NOT TRUE FALSE BOOL INT DINT
    REAL LREAL""".split()
)

RESERVED = frozenset(
    """ACTION END_ACTION ANY ANY_BIT ANY_DATE ANY_DERIVED ANY_ELEMENTARY ANY_INT ANY_MAGNITUDE ANY_NUM ANY_REAL
    ANY_STRING AT CAL CALC CALCN CASE END_CASE CONFIGURATION END_CONFIGURATION D DATE DATE_AND_TIME DT DS EN ENO FROM
    F_EDGE F_TRIG FUNCTION END_FUNCTION INITIAL_STEP INTERVAL JMP JMPC JMPCN L LD LDN LINT MOD N NON_RETAIN ON P
    PRIORITY R R1 R_EDGE R_TRIG READ_ONLY READ_WRITE REPEAT END_REPEAT RESOURCE END_RESOURCE RET RETAIN RETC RETCN
    RETURN S S1 SD SINGLE SINT SL SR RS ST STEP END_STEP STN STRING STRUCT END_STRUCT TASK TIME TIME_OF_DAY TOD
    TRANSITION END_TRANSITION UDINT UINT ULINT UNTIL USINT VAR_ACCESS VAR_CONFIG VAR_EXTERNAL VAR_GLOBAL VAR_IN_OUT
    VAR_TEMP WITH WORD WSTRING BYTE DWORD LWORD XOR ANDN ORN XORN
    LOG EXP SIN COS TAN ASIN ACOS ADD SUB MUL DIV EXPT MOVE TRUNC SHL SHR ROL ROR SEL MAX MIN LIMIT
    MUX GT GE EQ LE LT NE LEN LEFT RIGHT MID CONCAT INSERT DELETE REPLACE FIND CTU CTD CTUD TP TON TOF RTC SEMA
    CHAR WCHAR LDATE LTIME LTOD LDT REF_TO REF NULL CONTINUE METHOD END_METHOD CLASS END_CLASS INTERFACE
    END_INTERFACE NAMESPACE END_NAMESPACE USING PROPERTY THIS SUPER ABSTRACT FINAL OVERRIDE PUBLIC PRIVATE PROTECTED
    INTERNAL EXTENDS IMPLEMENTS OVERLAP""".split()
)
"""Words of the standard (edition 2 with its instruction list, SFC qualifiers, standard functions and function blocks;
edition 3) no name may be."""

FUNCTIONS = ("ABS", "SQRT", "LN", "ATAN")
"""Standard functions that may be called here."""

_TOKEN = re.compile(
    r"""(?P<space>[ \t\r\n]+)|(?P<comment>\(\*(?:(?!\(\*).)*?\*\))|(?P<real>\d+\.\d+(?:E[+-]?\d+)?)|(?P<int>\d+)
    |(?P<word>[A-Za-z_]\w*)|(?P<mark>:=|\.\.|<=|>=|<>|[-+*/=<>()\[\],;:.])""",
    re.X | re.S | re.A,
)

_GLUED = re.compile(r"[A-Za-z_0-9.]", re.A)
"""What can't follow a number: ``1.``, ``1E3``, ``2x``."""


class NotStructuredText(Exception):
    """The text is outside the subset that is translated; says where."""


@dataclass(frozen=True, slots=True)
class Token:
    """``kind`` is keyword, name, function, real, int or mark; keywords and functions are in capitals."""

    kind: str
    text: str
    line: int


def tokens(text: str) -> Iterator[Token]:
    """Split a text; nothing in it is skipped but space and comments, which are not nested."""
    place, line = 0, 1
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            raise NotStructuredText(f"line {line}: {text[place : place + 20]!r}")
        kind, place = str(match.lastgroup), match.end()
        if kind == "word":
            yield _word(match.group(), line)
        elif kind in ("real", "int"):
            yield _number(kind, match.group(), line, text[place : place + 2])
        elif kind == "mark":
            yield Token(kind, match.group(), line)
        line += match.group().count("\n")


def _number(kind: str, text: str, line: int, after: str) -> Token:
    if _GLUED.match(after) and after != "..":
        raise NotStructuredText(f"line {line}: {text + after} is no number of the standard")
    return Token(kind, text, line)


def _word(text: str, line: int) -> Token:
    if text.upper() in KEYWORDS:
        return Token("keyword", text.upper(), line)
    if text.upper() in FUNCTIONS:
        return Token("function", text.upper(), line)
    if text.upper() in RESERVED:
        raise NotStructuredText(f"line {line}: {text} is a word of the standard, not a name")
    if "__" in text or text.endswith("_"):
        raise NotStructuredText(f"line {line}: {text}: underscores stand alone, between letters or digits, or first")
    return Token("name", text, line)
