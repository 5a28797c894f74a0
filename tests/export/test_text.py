"""The exported text as a PLC programmer gets it: the standard's language, readable, complete."""

import re
from datetime import UTC, datetime
from importlib.util import find_spec

import numpy as np
import pytest

from estimator.identification.linear_model import Orders
from estimator.identification.settings import Settings
from estimator.signals.record import FloatArray
from hil.export.plc_estimator import PlcEstimator
from hil.export.plcopen import plcopen_xml
from hil.export.structured_text import POUS, Precision
from tests.export.iec.parser import Parser
from tests.export.iec.to_c import to_c
from tests.export.iec.tree import REALS
from tests.export.plc_runs import exported
from tests.export.plcopen_reading import read_plcopen

L = np.array([1.0, -0.9, 0.72])

SLOW = pytest.mark.campaign
"""The other parser takes seconds for a program: one of the four is read at every change."""


@pytest.mark.parametrize("precision", Precision)
def test_it_is_plain_and_narrow(precision: Precision) -> None:
    text = exported(PlcEstimator(L=L), precision)
    assert text.isascii()
    assert "$" not in text
    assert "\t" not in text
    assert max(map(len, text.splitlines())) <= 120


@pytest.mark.parametrize("precision", Precision)
def test_it_has_one_real_type_alone(precision: Precision) -> None:
    blocks = Parser(exported(PlcEstimator(L=L), precision)).blocks()
    assert list(blocks) == list(POUS)
    types = {variable.shape.element for block in blocks.values() for variable in block.variables.values()}
    assert types & set(REALS) == {precision.value}


def test_every_input_and_output_has_a_comment_and_a_named_type() -> None:
    document = read_plcopen(plcopen_xml(PlcEstimator(L=L), datetime.now(UTC)))
    interfaces = [pou.interface for pou in document.types.pous.pou]
    sections = [section for each in interfaces for section in (*each.input_vars, *each.output_vars)]
    parameters = [variable for section in sections for variable in section.variable]
    assert len(parameters) > 40
    assert [variable.name for variable in parameters if variable.documentation is None] == []
    assert [variable.name for variable in parameters if variable.type.array is not None] == []


@pytest.mark.parametrize(
    ("precision", "filter_L"),
    [
        pytest.param(precision, filter_L, marks=() if filter_L is L and precision is Precision.DOUBLE else SLOW)
        for precision in Precision
        for filter_L in (L, None)
    ],
)
@pytest.mark.campaign
def test_an_independent_parser_reads_the_same_program(precision: Precision, filter_L: FloatArray | None) -> None:
    if find_spec("blark") is None:
        pytest.skip("blark, a parser of IEC 61131-3, is not installed: pip install blark==0.8.3")
    from blark.parse import parse_source_code

    text = exported(PlcEstimator(L=filter_L), precision)
    found = parse_source_code(text)
    assert found.exception is None
    printed_from_its_tree = re.sub(r"\b(END_IF|END_WHILE)$", r"\1;", str(found.transform()), flags=re.M)
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


def test_orders_are_in_the_head_for_the_reader() -> None:
    text = exported(PlcEstimator(Settings(orders=Orders(2, 3, 4)), L=L))
    assert "y(t) = -a1 y(t-1) - .. - a2 y(t-2) + b1 u(t-4) + .. + b3 u(t-6)" in text
