"""A compiler that others wrote, the one of ``pyplcopen``, takes the exported program and refuses it with a fault.

It takes a part of the language (`tests.export.pyplcopen_dialect`), so it says nothing of how declarations are written;
it checks names, types, calls, indices and statements by its own reading of the standard. It does not insist on the
semicolon after END_IF and END_FOR; our own reader does.
"""

from dataclasses import replace

import numpy as np
import pytest

from estimator.identification.linear_model import Orders
from estimator.identification.settings import Settings
from hil.export.plc_estimator import PlcEstimator
from hil.export.plcopen import project
from hil.export.structured_text import Precision
from tests.chosen import one_in
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
    assert diagnostics(in_dialect(project(estimator, precision))) == []


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
    right = project(PlcEstimator(L=L))
    assert sum(before in pou.body for pou in right.pous) == 1
    wrong = replace(right, pous=tuple(replace(pou, body=pou.body.replace(before, after)) for pou in right.pous))
    assert diagnostics(in_dialect(wrong)) != []
