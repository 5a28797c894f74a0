"""A verdict is right only where it names what was hidden and nothing else."""

import pytest

from hil.proof.judge import Outcome, judge


def _effect(name, alike=(), **parameters):
    return {"name": name, "indistinguishable_from": list(alike), "parameters": parameters}


def _diagnosis(verdict, *effects):
    return {"verdict": verdict, "effects": list(effects), "parameters": {}}


def _truth(effect):
    return {"effect": effect, "hidden": {}, "true": {}}


CASES = [
    ("none", _diagnosis("no_mismatch"), Outcome.RIGHT),
    ("none", _diagnosis("unexplained"), Outcome.ABSTAINED),
    ("none", _diagnosis("explained", _effect("backlash")), Outcome.INVENTED),
    ("backlash", _diagnosis("explained", _effect("backlash")), Outcome.RIGHT),
    ("backlash", _diagnosis("no_mismatch"), Outcome.MISSED),
    ("backlash", _diagnosis("unexplained"), Outcome.ABSTAINED),
    ("backlash", _diagnosis("explained", _effect("stiffness_nonlinearity")), Outcome.WRONG),
    ("backlash", _diagnosis("explained", _effect("backlash"), _effect("road_grade")), Outcome.FALSE_CLAIM),
    ("actuator_lag", _diagnosis("explained", _effect("speed_filter", ["actuator_lag"])), Outcome.RIGHT),
    (
        "backlash+road_grade",
        _diagnosis("explained", _effect("road_grade"), _effect("backlash")),
        Outcome.RIGHT,
    ),
    ("backlash+road_grade", _diagnosis("explained", _effect("backlash")), Outcome.INCOMPLETE),
    ("speed_stiffened_shaft", _diagnosis("unexplained"), Outcome.ABSTAINED),
]


@pytest.mark.parametrize(("hidden", "diagnosis", "outcome"), CASES)
def test_every_pair_of_truth_and_verdict_has_its_outcome(hidden, diagnosis, outcome):
    assert judge(diagnosis, _truth(hidden)).outcome is outcome


def test_sizes_are_compared_under_the_names_of_the_fitted_law():
    truth = {
        "effect": "actuator_lag",
        "hidden": {"actuator_lag": {"current_loop_time_s": 0.012}},
        "true": {"J_M": 1.7, "gear_ratio": 5.6},
    }
    lag = _effect("actuator_lag", time_constant_s={"value": 0.0118, "ci95": [0.0115, 0.0121], "unit": "s"})
    diagnosis = {
        "verdict": "explained",
        "effects": [lag],
        "parameters": {"J_M": {"nominal": 1.5, "value": 1.6, "ci95": [1.55, 1.65], "unit": "kg m^2"}},
    }
    size, inertia = judge(diagnosis, truth).sizes
    assert (size.what, size.true, size.found, size.inside) == (
        "actuator_lag: time_constant_s",
        0.012,
        0.0118,
        True,
    )
    assert (inertia.what, inertia.true, inertia.inside) == ("J_M", 1.7, False)


@pytest.mark.parametrize("interval", [None, [None, None]])
def test_without_an_interval_nothing_is_said_of_it(interval):
    truth = {"effect": "none", "hidden": {}, "true": {"J_M": 1.7}}
    diagnosis = {
        **_diagnosis("no_mismatch"),
        "parameters": {"J_M": {"value": 1.6, "ci95": interval, "unit": ""}},
    }
    assert judge(diagnosis, truth).sizes[0].inside is None
