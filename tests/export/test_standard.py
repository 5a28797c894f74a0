"""The reader of these tests refuses what IEC 61131-3 refuses: each fault by its one difference from what is right."""

from __future__ import annotations

import pytest

from tests.export.iec.parser import Parser
from tests.export.iec.tokens import NotStructuredText

BODY = """
FUNCTION_BLOCK F
VAR_INPUT q : INT; END_VAR
VAR CONSTANT K : INT := 7; END_VAR
VAR a : INT; m : DINT; b : LREAL; c : BOOL; t : ARRAY[1..3] OF INT; END_VAR
{}
END_FUNCTION_BLOCK
"""

STATEMENTS = [
    # a semicolon ends every statement
    ("IF c THEN a := 1; END_IF;", "IF c THEN a := 1; END_IF"),
    ("IF c THEN a := 1; END_IF; a := 2;", "IF c THEN a := 1; END_IF a := 2;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR a := 1 TO 2 DO m := 1; END_FOR"),
    ("FOR a := 1 TO 2 DO EXIT; END_FOR;", "FOR a := 1 TO 2 DO EXIT END_FOR;"),
    ("a := 1; m := 2;", "a := 1 m := 2;"),
    # a list of statements is not empty
    ("IF c THEN a := 1; END_IF;", "IF c THEN END_IF;"),
    ("IF c THEN a := 1; ELSE a := 2; END_IF;", "IF c THEN a := 1; ELSE END_IF;"),
    ("IF c THEN a := 1; ELSIF c THEN a := 2; END_IF;", "IF c THEN a := 1; ELSIF c THEN END_IF;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR a := 1 TO 2 DO END_FOR;"),
    ("a := 1;", ""),
    # words of control
    ("IF c THEN a := 1; END_IF;", "IF c a := 1; END_IF;"),
    ("IF c THEN a := 1; ELSIF c THEN a := 2; END_IF;", "IF c THEN a := 1; ELSE IF c THEN a := 2; END_IF;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR a = 1 TO 2 DO m := 1; END_FOR;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR a := 1 TO 2 m := 1; END_FOR;"),
    ("FOR a := 2 TO 1 BY -1 DO m := 1; END_FOR;", "FOR a := 2 TO 1 BY 0 DO m := 1; END_FOR;"),
    ("FOR a := 1 TO 2 DO EXIT; END_FOR;", "EXIT;"),
    ("a := 1;", "a = 1;"),
    ("a := 1;", "a;"),
    ("a := 1;", "1 := a;"),
    # what may be written to
    ("a := 1;", "K := 1;"),
    ("a := 1;", "q := 1;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR a := 1 TO 2 DO a := 1; END_FOR;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR a := 1 TO 2 DO FOR a := 1 TO 2 DO m := 1; END_FOR; END_FOR;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR b := 1.0 TO 2.0 DO m := 1; END_FOR;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR q := 1 TO 2 DO m := 1; END_FOR;"),
    ("FOR a := 1 TO 2 DO m := 1; END_FOR;", "FOR t[1] := 1 TO 2 DO m := 1; END_FOR;"),
    ("FOR a := 1 TO K DO m := 1; END_FOR;", "FOR a := 1 TO m DO c := TRUE; END_FOR;"),
    # types are not mixed
    ("a := 1;", "a := 1.0;"),
    ("b := 1.0;", "b := 1;"),
    ("b := b * b;", "b := b * a;"),
    ("m := m + 1;", "m := m + a;"),
    ("a := a + 1;", "a := m;"),
    ("c := a = 1;", "c := a;"),
    ("c := c = c;", "c := c = 1;"),
    ("c := c AND c;", "c := c AND a;"),
    ("a := a + a;", "a := a OR a;"),
    ("IF a = 1 THEN a := 1; END_IF;", "IF a THEN a := 1; END_IF;"),
    ("c := NOT c;", "a := NOT a;"),
    ("b := -b;", "c := -c;"),
    ("b := ABS(b);", "a := ABS(a);"),
    ("b := ABS(b);", "b := ABS(b, b);"),
    ("b := ABS(b);", "b := ABS();"),
    ("b := ABS(b);", "b := ABS;"),
    ("b := ABS(b);", "b := UNKNOWN(b);"),
    # one operator before an operand
    ("c := NOT c;", "c := NOT NOT c;"),
    ("a := -a;", "a := - -a;"),
    ("c := NOT (a > 1);", "c := NOT -a > 1;"),
    # literals
    ("b := 1.0;", "b := 1.;"),
    ("b := 0.5;", "b := .5;"),
    ("b := 1.0E3;", "b := 1E3;"),
    ("b := 1.0E-3;", "b := 1.0E;"),
    ("b := 1.0E-3;", "b := 1.0e-3f;"),
    ("a := 12;", "a := 12x;"),
    ("a := 32767;", "a := 32768;"),
    ("a := -32768;", "a := -32769;"),
    ("m := 2147483647;", "m := 2147483648;"),
    ("a := a + 32767;", "a := a + 32768;"),
    # arrays
    ("a := t[1];", "a := t;"),
    ("a := t[3];", "a := t[4];"),
    ("a := t[1];", "a := t[0];"),
    ("a := t[a];", "a := t[b];"),
    ("a := t[a];", "a := t[m];"),
    ("a := t[1];", "a := t[1, 1];"),
    ("a := t[1];", "a := a[1];"),
    ("a := t[1];", "a := t(1);"),
    # names
    ("a := K;", "a := k2;"),
    ("a := 1;", "x := 1;"),
    ("a := 1;", "a.x := 1;"),
    ("a := 1;", "a();"),
    # comments and characters
    ("a := 1; (* one *)", "a := 1; (* one (* two *) three *)"),
    ("a := 1; (* one *)", "a := 1; (* one"),
    ("a := 1; (* one *)", "a := 1; // one\n"),
    ("a := 1; (* one *)", "a := 1; /* one */"),
    ("a := 1; (* one *)", "a := 1; {one}"),
    ("a := 1;", "\N{LATIN SMALL LETTER A WITH DIAERESIS} := 1;"),
    ("c := a = 1;", "c := a == 1;"),
    ("c := a <> 1;", "c := a != 1;"),
    ("c := (a = 1);", "c := (a = 1;"),
]

DECLARATIONS = [
    ("VAR x : INT; END_VAR", "VAR END_VAR"),
    ("VAR x : INT; END_VAR", "VAR x : INT; END_VAR;"),
    ("VAR x : INT; END_VAR", "VAR x : INT END_VAR"),
    ("VAR x : INT; END_VAR", "VAR x INT; END_VAR"),
    ("VAR x : INT; END_VAR", "VAR x := INT; END_VAR"),
    ("VAR x : INT; END_VAR", "VAR : INT; END_VAR"),
    ("VAR x : INT; END_VAR", "VAR x : INT;"),
    ("VAR x : INT; END_VAR", "VAR x : FLOAT; END_VAR"),
    ("VAR x : INT; END_VAR", "VAR x : SINT; END_VAR"),  # of the standard, not of what is translated
    ("VAR x : INT; y : INT; END_VAR", "VAR x : INT; X : INT; END_VAR"),
    ("VAR x : INT; END_VAR VAR y : INT; END_VAR", "VAR x : INT; END_VAR VAR_OUTPUT x : INT; END_VAR"),
    ("VAR x : INT; END_VAR", "VAR T_A : INT; END_VAR"),
    ("VAR x : INT; END_VAR", "VAR f : INT; END_VAR"),
    ("VAR CONSTANT x : INT := 1; END_VAR", "VAR CONSTANT x : INT; END_VAR"),
    ("VAR CONSTANT x : INT := 1; END_VAR", "VAR_INPUT CONSTANT x : INT := 1; END_VAR"),
    ("VAR x : INT := -1; END_VAR", "VAR x : INT := 1.0; END_VAR"),
    ("VAR x : INT := -1; END_VAR", "VAR x : INT := -TRUE; END_VAR"),
    ("VAR x : INT := 1; END_VAR", "VAR x : INT := 40000; END_VAR"),
    ("VAR x : INT := 1; END_VAR", "VAR x : INT := (1 + 2); END_VAR"),
    ("VAR x : BOOL := TRUE; END_VAR", "VAR x : BOOL := 0.0; END_VAR"),
    ("VAR y : INT := 1; x : INT := 1; END_VAR", "VAR y : INT := 1; x : INT := y; END_VAR"),
    ("VAR x : ARRAY[1..3] OF INT; END_VAR", "VAR M : INT; x : ARRAY[1..M] OF INT; END_VAR"),
    ("VAR x : ARRAY[1..3] OF INT; END_VAR", "VAR x : ARRAY[3..1] OF INT; END_VAR"),
    ("VAR x : ARRAY[1..3] OF INT; END_VAR", "VAR x : ARRAY[3] OF INT; END_VAR"),
    ("VAR x : ARRAY[1..3] OF INT; END_VAR", "VAR x : ARRAY[1..3]; END_VAR"),
    ("VAR x : ARRAY[1..3] OF INT; END_VAR", "VAR x : ARRAY(1..3) OF INT; END_VAR"),
    ("VAR x : ARRAY[1..3] OF INT; END_VAR", "VAR x : ARRAY[1.0..3.0] OF INT; END_VAR"),
    ("VAR x : ARRAY[1..2] OF INT := [1, 2]; END_VAR", "VAR x : ARRAY[1..2] OF INT := [1, 2, 3]; END_VAR"),
    ("VAR x : ARRAY[1..2] OF INT := [1, 2]; END_VAR", "VAR x : ARRAY[1..2] OF INT := [1, 2.0]; END_VAR"),
    ("VAR x : ARRAY[1..2] OF INT := [1, 2]; END_VAR", "VAR x : ARRAY[1..2] OF INT := [1, 2,]; END_VAR"),
    ("VAR x : ARRAY[1..2] OF INT := [1, 2]; END_VAR", "VAR x : ARRAY[1..2] OF INT := []; END_VAR"),
    ("VAR x : ARRAY[1..2] OF INT := [1, 2]; END_VAR", "VAR x : ARRAY[1..2] OF INT := 1, 2; END_VAR"),
    ("VAR x : G; END_VAR", "VAR x : G := 1; END_VAR"),
    ("VAR x : G; END_VAR", "VAR_INPUT x : G; END_VAR"),
    ("VAR x : G; END_VAR", "VAR CONSTANT x : G; END_VAR"),
    ("VAR x : G; END_VAR", "VAR x : ARRAY[1..2] OF G; END_VAR"),  # of the standard, not of what is translated
    ("VAR x : G; END_VAR", "VAR x : F; END_VAR"),  # recursion
    ("VAR x : G; END_VAR", "VAR x : H; END_VAR"),  # declared below
    ("VAR x : G; END_VAR", "VAR x : Prg; END_VAR"),  # a program
    ("VAR x : T_A; END_VAR", "VAR x : T_B; END_VAR"),
]

AROUND = """
TYPE T_A : ARRAY[1..2] OF INT; END_TYPE
FUNCTION_BLOCK G VAR y : INT; END_VAR y := 1; END_FUNCTION_BLOCK
PROGRAM Prg VAR y : INT; END_VAR y := 1; END_PROGRAM
FUNCTION_BLOCK F {} VAR w : INT; END_VAR w := 1; END_FUNCTION_BLOCK
FUNCTION_BLOCK H VAR y : INT; END_VAR y := 1; END_FUNCTION_BLOCK
"""

NAMES = """r s n p l d ld st add max min abs en eno step action task interval retain return while case time date
word real lreal not_ a__b 2a var program function method class this ref sqrt ton f_trig left""".split()

CALLING = """
TYPE T_A : ARRAY[1..2] OF INT; END_TYPE
TYPE T_B : ARRAY[1..2] OF INT; END_TYPE
FUNCTION_BLOCK G
VAR_INPUT x : INT; v : T_A; END_VAR
VAR_OUTPUT y : INT; END_VAR
VAR z : INT; END_VAR
z := 1;
END_FUNCTION_BLOCK
FUNCTION_BLOCK F
VAR g1 : G; a : INT; ta : T_A; tb : T_B; u : ARRAY[1..2] OF INT; END_VAR
{}
END_FUNCTION_BLOCK
"""

CALLS = [
    ("g1(x := 1);", "g1(1);"),
    ("g1(x := 1);", "g1(x := 1)"),
    ("g1(x := 1);", "g1(x := 1;"),
    ("g1(x := 1);", "g1(x = 1);"),
    ("g1(x := 1);", "g1(x := 1,);"),
    ("g1(x := 1);", "g1(x := 1, x := 2);"),
    ("g1(x := 1);", "g1(x := 1.0);"),
    ("g1(x := 1, v := ta);", "g1(x := 1 v := ta);"),
    ("g1(x := 1);", "g1(y := 1);"),
    ("g1(x := 1);", "g1(z := 1);"),
    ("g1(x := 1);", "g1(y => a);"),
    ("g1(x := 1);", "G(x := 1);"),
    ("g1(x := 1); a := g1.y;", "a := g1(x := 1);"),
    ("a := g1.y;", "a := g1.z;"),
    ("a := g1.y;", "a := g1.w;"),
    ("a := g1.y;", "a := g1;"),
    ("a := g1.y;", "g1.y := a;"),
    ("a := g1.y;", "g1 := a;"),
    ("a := g1.v[1];", "a := g1.v;"),
    ("g1(v := ta);", "g1(v := u);"),  # an unnamed array type is no other one
    ("g1(v := ta);", "g1(v := tb);"),  # nor is a type of another name
    ("g1(v := ta);", "g1(v := ta[1]);"),
    ("g1(v := ta);", "g1(v := a);"),
]

POUS = [
    ("TYPE T : ARRAY[1..2] OF INT; END_TYPE", "TYPE T : ARRAY[1..2] OF INT; END_TYPE;"),
    ("TYPE T : ARRAY[1..2] OF INT; END_TYPE", "TYPE T : ARRAY[1..2] OF INT END_TYPE"),
    ("TYPE T : ARRAY[1..2] OF INT; END_TYPE", "TYPE END_TYPE"),
    ("TYPE T : ARRAY[1..2] OF INT; U : ARRAY[1..2] OF INT; END_TYPE", "TYPE T : ARRAY[1..2] OF INT; t : INT; END_TYPE"),
    ("PROGRAM Prg VAR a : INT; END_VAR a := 1; END_PROGRAM", "PROGRAM Prg VAR a : INT; END_VAR a := 1; END_PROGRAM;"),
    (
        "PROGRAM Prg VAR a : INT; END_VAR a := 1; END_PROGRAM",
        "PROGRAM Prg VAR a : INT; END_VAR a := 1; END_FUNCTION_BLOCK",
    ),
    ("PROGRAM Prg VAR a : INT; END_VAR a := 1; END_PROGRAM", "PROGRAM Prg VAR a : INT; END_VAR a := 1;"),
    ("PROGRAM Prg VAR a : INT; END_VAR a := 1; END_PROGRAM", "PROGRAM VAR a : INT; END_VAR a := 1; END_PROGRAM"),
    ("PROGRAM Prg VAR a : INT; END_VAR a := 1; END_PROGRAM", "a := 1;"),
]


def read(text: str) -> None:
    Parser(text).blocks()


def refused(text: str) -> None:
    with pytest.raises(NotStructuredText, match=r"^line \d+: "):
        read(text)


@pytest.mark.parametrize(("right", "wrong"), STATEMENTS)
def test_a_wrong_statement(right: str, wrong: str) -> None:
    read(BODY.format(right))
    refused(BODY.format(wrong))


@pytest.mark.parametrize(("right", "wrong"), DECLARATIONS)
def test_a_wrong_declaration(right: str, wrong: str) -> None:
    read(AROUND.format(right))
    refused(AROUND.format(wrong))


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_is_none(name: str) -> None:
    read(AROUND.format(f"VAR x{name.replace('_', '')} : INT; END_VAR"))
    refused(AROUND.format(f"VAR {name} : INT; END_VAR"))
    refused(AROUND.format(f"VAR {name.upper()} : INT; END_VAR"))


@pytest.mark.parametrize(("right", "wrong"), CALLS)
def test_a_wrong_call(right: str, wrong: str) -> None:
    read(CALLING.format(right))
    refused(CALLING.format(wrong))


@pytest.mark.parametrize(("right", "wrong"), POUS)
def test_a_wrong_unit(right: str, wrong: str) -> None:
    read(right)
    refused(wrong)
    refused(f"{right}\n{right}")  # declared twice
