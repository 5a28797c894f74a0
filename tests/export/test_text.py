"""The exported text as a PLC programmer gets it: the standard's language, readable, complete."""

from __future__ import annotations

import re
from importlib.util import find_spec

import numpy as np
import pytest

from estimator.errors import BadModel, BadSetting
from estimator.identification.identify import Settings
from estimator.identification.linear_model import Orders
from estimator.identification.online import regression_kernel
from estimator.signals import decimate_kernel
from estimator.signals.record import FloatArray
from hil.export.plc_estimator import PlcEstimator
from hil.export.structured_text import BLOCKS, Precision, structured_text
from tests.export.iec.parser import Parser
from tests.export.iec.to_c import to_c
from tests.export.iec.tokens import NotStructuredText
from tests.export.iec.tree import REALS

L = np.array([1.0, -0.9, 0.72])

SLOW = pytest.mark.campaign
"""The other parser takes seconds for a program: one of the four is read at every change."""


@pytest.mark.parametrize("precision", Precision)
def test_it_is_plain_and_narrow(precision: Precision) -> None:
    text = structured_text(PlcEstimator(L=L), precision)
    assert text.isascii()
    assert "$" not in text
    assert "\t" not in text
    assert max(map(len, text.splitlines())) <= 120


@pytest.mark.parametrize("precision", Precision)
def test_it_has_one_real_type_alone(precision: Precision) -> None:
    blocks = Parser(structured_text(PlcEstimator(L=L), precision)).blocks()
    assert list(blocks) == list(BLOCKS)
    types = {variable.type for block in blocks.values() for variable in block.variables.values()}
    assert types & set(REALS) == {precision.value}


@pytest.mark.parametrize("name", BLOCKS)
def test_every_input_and_output_has_a_comment(name: str) -> None:
    text = structured_text(PlcEstimator(L=L))
    block = text.partition(f"FUNCTION_BLOCK {name}\n")[2].partition("END_FUNCTION_BLOCK")[0]
    interface = re.findall(r"VAR_(?:IN|OUT)PUT\n(.*?)END_VAR", block, re.S)
    lines = [line for part in interface for line in part.splitlines() if ":" in line and ";" in line]
    assert len(lines) > 5
    assert [line for line in lines if "(*" not in line] == []


@pytest.mark.parametrize(
    ("precision", "filter_L"),
    [
        pytest.param(precision, filter_L, marks=() if filter_L is L and precision is Precision.DOUBLE else SLOW)
        for precision in Precision
        for filter_L in (L, None)
    ],
)
def test_an_independent_parser_reads_the_same_program(precision: Precision, filter_L: FloatArray | None) -> None:
    if find_spec("blark") is None:
        pytest.skip("blark, a parser of IEC 61131-3, is not installed: pip install blark==0.8.3")
    from blark.parse import parse_source_code

    text = structured_text(PlcEstimator(L=filter_L), precision)
    found = parse_source_code(text)
    assert found.exception is None
    printed_from_its_tree = str(found.transform())
    assert to_c(Parser(printed_from_its_tree).blocks()) == to_c(Parser(text).blocks())


@pytest.mark.parametrize(
    ("value", "double", "single"),
    [
        (0.1, "0.1", "0.1"),
        (1.0, "1.0", "1.0"),
        (-1e30, "-1.0E30", "-1.0E30"),
        (1 / 3, "0.3333333333333333", "0.33333334"),
        (1.5e-18, "1.5E-18", "1.5E-18"),
        (1e16, "1.0E16", "1.0E16"),
    ],
)
def test_a_number_reads_back_as_itself(value: float, double: str, single: str) -> None:
    assert Precision.DOUBLE.literal(value) == double
    assert Precision.SINGLE.literal(value) == single
    assert float(double) == value
    assert np.float32(single) == np.float32(value)


def test_decimator_and_estimator_agree_on_what_is_no_measurement() -> None:
    assert regression_kernel.LARGEST == decimate_kernel.LARGEST == Precision.DOUBLE.largest


def test_the_origin_can_not_end_the_comment() -> None:
    blocks = Parser(structured_text(PlcEstimator(L=L, origin="a *) b (* c é"))).blocks()
    assert list(blocks) == list(BLOCKS)


@pytest.mark.parametrize(
    ("cycle_s", "settings", "said"),
    [
        (0.003, Settings(), "expected"),
        (0.0, Settings(), "sample_time_s|expected"),
        (-0.01, Settings(), "expected"),
        (float("nan"), Settings(), "expected"),
        (0.000005, Settings(), "at most 32767"),
        (0.01, Settings(high_pass_hz=30.0), "Nyquist"),
    ],
)
def test_what_makes_no_sense_is_refused(cycle_s: float, settings: Settings, said: str) -> None:
    with pytest.raises(BadSetting, match=said):
        PlcEstimator(settings, cycle_s, L)


def test_a_filter_that_could_not_filter_is_refused() -> None:
    with pytest.raises(BadModel, match="root of magnitude"):
        PlcEstimator(L=np.array([1.0, -1.2]))


@pytest.mark.parametrize(
    "fault",
    [
        "FUNCTION_BLOCK F VAR a : INT; A : INT; END_VAR END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F VAR r : INT; END_VAR END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F VAR a : INT; END_VAR a := 1.0; END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F VAR a : INT; b : LREAL; END_VAR b := b * a; END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F VAR a : INT; END_VAR b := 1; END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F VAR CONSTANT a : INT := 1; END_VAR a := 1; END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F VAR a : INT; END_VAR FOR a := 1 TO 2 DO a := 1; END_FOR END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F VAR a : INT; END_VAR IF a THEN a := 1; END_IF END_FUNCTION_BLOCK",
        "FUNCTION_BLOCK F (* one (* two *) three *) END_FUNCTION_BLOCK",
    ],
)
def test_the_reader_of_these_tests_refuses_what_a_plc_refuses(fault: str) -> None:
    with pytest.raises(NotStructuredText):
        Parser(fault).blocks()


def test_orders_are_in_the_head_for_the_reader() -> None:
    text = structured_text(PlcEstimator(Settings(orders=Orders(2, 3, 4)), L=L))
    assert "y(t) = -a1 y(t-1) - .. - a2 y(t-2) + b1 u(t-4) + .. + b3 u(t-6)" in text
