"""diagnosis.json: the contract's keys, numbers kept, nothing JSON does not have."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, strategies as st

from estimator.diagnosis.result import Diagnosis, Mismatch, OffNominal, Verdict
from hil.report.diagnosis_json import diagnosis_json, diagnosis_text
from hil.report.numbers import json_number
from tests.report.conftest import unnamed_table


def refuse_constant(name: str) -> Any:
    raise AssertionError(f"{name} is not JSON")


def test_the_text_is_strict_json_of_the_contract(diagnosis: Diagnosis) -> None:
    content = json.loads(diagnosis_text(diagnosis), parse_constant=refuse_constant)
    assert content == diagnosis_json(diagnosis)
    assert list(content) == [
        "schema",
        "doubts",
        "verdict",
        "statement",
        "mismatch",
        "effects",
        "rejected",
        "untestable",
        "unnamed",
        "fit",
        "parameters",
        "load_torque",
        "timing_s",
        "warnings",
        "discrepancy",
        "strays",
        "remainder",
        "tables",
        "traces",
        "refinements",
        "effort",
    ]
    assert content["schema"] == "hil.diagnosis/1"
    assert content["verdict"] == "explained"
    assert content["timing_s"] == {"total": 4.2}


def test_where_the_mismatch_is_and_what_it_was_found_to_be_is_written(diagnosis: Diagnosis) -> None:
    content = diagnosis_json(diagnosis)
    assert content["mismatch"] == {
        "detected": True,
        "element": "shaft",
        "time_s": {"run_1": [[1.5, 6.2], [17.0, 22.1]]},
        "band_hz": [6.5, 11.0],
        "region": {"signal": "shaft torque", "low": -20.0, "high": 20.0, "unit": "Nm"},
        "p_value": 0.0,
    }
    assert content["effects"][0] == {
        "name": "backlash",
        "element": "shaft",
        "statement": "the shaft has a backlash of 0.021 rad in total",
        "parameters": {
            "gap_rad": {"value": 0.021, "ci95": [0.020, 0.022], "unit": "rad"},
            "contact_rad": {"value": 0.0012, "ci95": [None, None], "unit": "rad"},
        },
        "time_s": {"run_1": [[1.5, 6.2]]},
        "indistinguishable_from": ["shaft_hysteresis"],
        "alternatives": {},
        "share": 0.94,
        "probability": 0.95,
        "necessity": 0.97,
        "least_necessity": 0.9,
        "counted": {"right": 18, "of": 18},
        "evidence": {"delta_bic": 5321.0, "holdout_rms_before": 0.41, "holdout_rms_after": 0.052, "p_value": 1e-12},
    }


def test_what_was_not_found_and_how_well_it_fits_is_written(diagnosis: Diagnosis) -> None:
    content = diagnosis_json(diagnosis)
    assert content["rejected"][1] == {
        "name": "stribeck_friction",
        "reason": "its interval holds the null",
        "delta_bic": -17.2,
    }
    assert content["untestable"][0]["suggested_test"] == "reversal"
    assert content["fit"] == {
        "unit": "rad/s",
        "nominal": 1.72,
        "retuned": 1.41,
        "augmented": 0.0521,
        "holdout_retuned": 1.38,
        "holdout_augmented": 0.0533,
        "noise_floor": 0.0502,
        "outputs": [],
    }
    assert content["parameters"]["b_L"] == {"nominal": 0.9, "value": 0.92, "ci95": [0.8, None], "unit": "Nm s/rad"}


@pytest.mark.parametrize("verdict", list(Verdict))
def test_what_is_not_known_is_null(diagnosis: Diagnosis, verdict: Verdict) -> None:
    nothing = Mismatch(False, None, {}, None, None, math.nan)
    content = diagnosis_json(replace(diagnosis, verdict=verdict, mismatch=nothing, effects=()))
    assert content["verdict"] in ("explained", "partly_explained", "unexplained", "no_mismatch")
    assert content["mismatch"] == {
        "detected": False,
        "element": None,
        "time_s": {},
        "band_hz": None,
        "region": None,
        "p_value": None,
    }


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_rounding_keeps_nine_digits(value: float) -> None:
    rounded = json_number(value)
    assert rounded is not None
    assert math.isclose(rounded, value, rel_tol=1e-9)


def test_a_law_without_a_name_is_written(diagnosis: Diagnosis) -> None:
    content = diagnosis_json(replace(diagnosis, table=unnamed_table(), verdict=Verdict.UNEXPLAINED))
    written = content["tables"]["shaft_twist"]
    assert written["element"] == "shaft"
    assert (written["knots"], written["values"]) == ([-0.04, -0.02, 0.0, 0.02, 0.04], [40.0, 20.0, 0.0, -20.0, -40.0])
    assert written["reached"] == [-0.03, 0.025]
    assert content["unnamed"] == {
        "element": "shaft",
        "terms": [{"law": "a curve over the twist of the shaft", "coefficient": 40.0}],
        "rms_before": 0.41,
        "rms_after": 0.12,
    }
    assert content["discrepancy"]["laws"] == [content["unnamed"]]
    assert diagnosis_json(replace(diagnosis, table=unnamed_table()))["unnamed"] is None


def test_nominal_values_that_are_off_are_given_as_a_ratio(diagnosis: Diagnosis) -> None:
    assert diagnosis_json(diagnosis)["strays"] == []
    off = replace(diagnosis, off_nominal=(OffNominal("J_L", 1.11, 0.04),))
    assert diagnosis_json(off)["strays"] == [{"parameter": "J_L", "ratio": 1.11, "tolerance": 0.04}]
