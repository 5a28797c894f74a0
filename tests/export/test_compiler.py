"""A compiler that others wrote, the one of ``pyplcopen``, takes the exported program and refuses it with a fault.

It takes a part of the language (`tests.export.pyplcopen_dialect`), so it says nothing of how declarations are written;
it checks names, types, calls, indices and statements by its own reading of the standard. It does not insist on the
semicolon after END_IF and END_FOR; our own reader does.
"""

from datetime import UTC, datetime

import numpy as np
import pytest

from estimator.identification.linear_model import Orders
from estimator.identification.settings import Settings
from hil.export.plc_estimator import PlcEstimator
from hil.export.plcopen import plcopen_xml
from hil.export.structured_text import Precision
from tests.chosen import one_in
from tests.export.iec.parser import Parser
from tests.export.iec.tokens import NotStructuredText
from tests.export.plcopen_reading import read_plcopen
from tests.export.pyplcopen_dialect import in_dialect

pyplcopen = pytest.importorskip("pyplcopen", reason="pyplcopen, which has a compiler of IEC 61131-3, is not installed")

L = np.array([1.0, -0.9, 0.72])

ESTIMATORS = [
    PlcEstimator(L=L),
    PlcEstimator(),
    PlcEstimator(L=np.ones(1)),
    PlcEstimator(Settings(orders=Orders(2, 3, 4))),
    PlcEstimator(Settings(orders=Orders(0, 6, 1), sample_time_s=0.01), 0.01),
]


def diagnostics(text: str) -> list[str]:
    return [each["message"] for each in pyplcopen._StLanguageDocument(text).diagnostics()]


@pytest.mark.parametrize("precision", Precision)
@pytest.mark.parametrize("estimator", one_in(3, ESTIMATORS), ids=range(len(ESTIMATORS)))
def test_the_program_compiles(estimator: PlcEstimator, precision: Precision) -> None:
    document = plcopen_xml(estimator, datetime.now(UTC), precision)
    assert diagnostics(in_dialect(read_plcopen(document))) == []


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("phase := FACTOR;", "phase := SHARE;"),
        ("phase := FACTOR;", "phase := UNKNOWN;"),
        ("phase := FACTOR;", "phase := FACTOR"),
        ("phase := FACTOR;", "phase = FACTOR;"),
        ("    heldTorque := torque;\n", "    heldTorque := okay;\n"),
        ("good := torqueFits AND outputFits;", "good := torqueFits AND torque;"),
        ("isNew := phase = 0;", "isNew := phase;"),
        ("windowTorque[i - 1]", "windowTorque[torque]"),
        ("windowTorque[i - 1]", "windowTorque[i, 1]"),
        ("facV[i, j] := element", "facV[i] := element"),
        ("gainF.quad", "gainF.facE"),
        ("gainF.quad", "gainF.unknown"),
        ("IF good THEN", "IF bad THEN"),
        ("END_IF;\nphase", "phase"),
        ("usedCount := usedCount + 1;", "usedCount := usedCount + 1.0;"),
        ("oefo(reset := reset OR restart, torque", "oefo(reset := torqueM1, torque"),
    ],
)
def test_it_would_notice_a_fault(before: str, after: str) -> None:
    document = plcopen_xml(PlcEstimator(L=L), datetime.now(UTC))
    assert before in document
    assert diagnostics(in_dialect(read_plcopen(document.replace(before, after)))) != []


BODY = """
FUNCTION_BLOCK F
VAR_INPUT q : INT; END_VAR
VAR CONSTANT K : INT := 7; END_VAR
VAR a : INT; m : DINT; b : LREAL; c : BOOL; t : ARRAY[1..3] OF INT; END_VAR
{}
END_FUNCTION_BLOCK
"""

LOOP = "FOR a := 1 TO 2 DO m := 1; END_FOR;"

STATEMENTS = [
    ("IF c THEN a := 1; END_IF;", "IF c THEN a := 1; END_IF"),  # a semicolon ends every statement: MATIEC
    (LOOP, "FOR a := 1 TO 2 DO m := 1; END_FOR"),
    ("IF c THEN a := 1; END_IF;", "IF c THEN END_IF;"),  # no list of statements is empty
    ("IF c THEN a := 1; ELSIF c THEN a := 2; END_IF;", "IF c THEN a := 1; ELSE IF c THEN a := 2; END_IF;"),
    (LOOP, "EXIT;"),
    (LOOP, "FOR a := 1 TO 2 DO a := 1; END_FOR;"),
    (LOOP, "FOR a := 1 TO m DO c := TRUE; END_FOR;"),
    ("a := 1;", "K := 1;"),
    ("a := 1;", "q := 1;"),
    ("a := 1;", "a := 1.0;"),  # types are not mixed
    ("b := 1.0;", "b := 1;"),
    ("m := m + 1;", "m := m + a;"),
    ("c := c AND c;", "c := c AND a;"),
    ("b := ABS(b);", "b := UNKNOWN(b);"),
    ("c := NOT c;", "c := NOT NOT c;"),
    ("b := 1.0E3;", "b := 1E3;"),
    ("a := 32767;", "a := 32768;"),
    ("a := t[3];", "a := t[4];"),
    ("a := t[a];", "a := t[m];"),
    ("a := K;", "a := k2;"),
    ("a := 1; (* one *)", "a := 1; (* one (* two *) three *)"),
    ("a := 1; (* one *)", "a := 1; // one\n"),
]

AROUND = """
TYPE T_A : ARRAY[1..2] OF INT; END_TYPE
FUNCTION_BLOCK G
VAR_INPUT v : T_A; END_VAR VAR_OUTPUT y : INT; END_VAR VAR z : INT; END_VAR
z := 1;
END_FUNCTION_BLOCK
FUNCTION_BLOCK F {} VAR w : INT; ta : T_A; u : ARRAY[1..2] OF INT; g1 : G; END_VAR {} END_FUNCTION_BLOCK
"""

DECLARATIONS = [
    ("VAR x : INT; END_VAR", "VAR END_VAR"),
    ("VAR x : INT; END_VAR", "VAR x : FLOAT; END_VAR"),
    ("VAR x : INT; y : INT; END_VAR", "VAR x : INT; X : INT; END_VAR"),
    ("VAR CONSTANT x : INT := 1; END_VAR", "VAR CONSTANT x : INT; END_VAR"),
    ("VAR x : INT := -1; END_VAR", "VAR x : INT := 1.0; END_VAR"),
    ("VAR x : ARRAY[1..2] OF INT := [1, 2]; END_VAR", "VAR x : ARRAY[1..2] OF INT := [1, 2, 3]; END_VAR"),
    ("VAR x : G; END_VAR", "VAR x : F; END_VAR"),
]

CALLS = [
    ("g1(v := ta);", "g1(v := u);"),  # an unnamed array type is no other one
    ("g1(v := ta);", "g1(v := ta, v := ta);"),
    ("g1(v := ta);", "g1(z := 1);"),
    ("w := g1.y;", "w := g1.z;"),
    ("w := g1.y;", "g1.y := w;"),
]

NAMES = "r s n d st add max abs en step action task interval retain time date real not_ a__b 2a this sqrt ton".split()

FAULTS = [
    *((BODY.format(right), BODY.format(wrong)) for right, wrong in STATEMENTS),
    *((AROUND.format(right, "w := 1;"), AROUND.format(wrong, "w := 1;")) for right, wrong in DECLARATIONS),
    *((AROUND.format("", right), AROUND.format("", wrong)) for right, wrong in CALLS),
    *((AROUND.format("VAR x1 : INT; END_VAR", "w := 1;"), AROUND.format(f"VAR {name} : INT; END_VAR", "w := 1;"))
      for name in NAMES),
]  # fmt: skip


@pytest.mark.parametrize(("right", "wrong"), FAULTS)
def test_a_fault_is_refused_by_its_line(right: str, wrong: str) -> None:
    Parser(right).blocks()
    with pytest.raises(NotStructuredText, match=r"^line \d+: "):
        Parser(wrong).blocks()
