"""The exported PLCopen XML: valid against the TC6 schema, and the same program when another library reads it."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from estimator.identification.linear_model import Orders
from estimator.identification.settings import Settings
from hil.export import Tc6
from hil.export.plc_estimator import PlcEstimator
from hil.export.plcopen import plcopen_xml
from hil.export.structured_text import Precision
from tests.chosen import one_in
from tests.export.drives import bad_drive
from tests.export.iec.parser import Parser
from tests.export.iec.to_c import to_c
from tests.export.plc_runs import assert_equal_bits, execute, exported, on_host
from tests.export.plcopen_reading import as_structured_text, read_plcopen

SCHEMA = etree.XMLSchema(etree.parse(Path(__file__).parent / "schema" / "tc6_xml_v201.xsd"))
WRITTEN = datetime(2026, 2, 3, 4, 5, 6, tzinfo=UTC)
L = np.array([1.0, -0.9, 0.72])

ESTIMATORS = [
    PlcEstimator(L=L),
    PlcEstimator(),
    PlcEstimator(L=np.ones(1)),
    PlcEstimator(Settings(orders=Orders(0, 6, 1), sample_time_s=0.01), 0.01),
    PlcEstimator(L=L, origin="a <b> & \"c\" *) é.json, recording ]]> 'd'"),
]


def document(estimator: PlcEstimator, precision: Precision = Precision.DOUBLE) -> str:
    return plcopen_xml(estimator, WRITTEN, precision)


def refusal(text: str) -> str:
    SCHEMA.validate(etree.fromstring(text.encode()))
    return str(SCHEMA.error_log)


@pytest.mark.parametrize("precision", Precision)
@pytest.mark.parametrize("estimator", ESTIMATORS, ids=range(len(ESTIMATORS)))
def test_it_is_valid_against_the_schema(estimator: PlcEstimator, precision: Precision) -> None:
    assert refusal(document(estimator, precision)) == ""


@pytest.mark.parametrize("precision", Precision)
@pytest.mark.parametrize("estimator", one_in(3, ESTIMATORS), ids=range(len(ESTIMATORS)))
def test_another_library_reads_the_same_program(estimator: PlcEstimator, precision: Precision) -> None:
    read = as_structured_text(read_plcopen(document(estimator, precision)))
    assert to_c(Parser(read).blocks()) == to_c(Parser(exported(estimator, precision)).blocks())


def test_what_it_read_is_executed_and_equals_the_host_to_the_bit(tmp_path: Path) -> None:
    estimator = PlcEstimator(L=L)
    read = as_structured_text(read_plcopen(document(estimator)))
    assert_equal_bits(execute(read, bad_drive(), tmp_path), on_host(estimator, bad_drive()))


def test_the_versions_differ_in_the_namespace_alone() -> None:
    newer, older = (plcopen_xml(PlcEstimator(L=L), WRITTEN, version=version) for version in (Tc6.V2_01, Tc6.V2_0))
    assert newer.count("tc6_0201") == 1
    assert older == newer.replace("tc6_0201", "tc6_0200")
