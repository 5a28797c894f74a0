"""The score of a case: what counts as right, where, when, and how large."""

import pytest

from estimator.physics.catalogue import EFFECTS as CATALOGUE
from hil.proof.judge import compare
from hil.proof.kinds import kind
from hil.proof.score import FAILED, LOOK_ALIKE, Answer, iou, score
from hil.proof.truth.specimen import EFFECTS, draw_specimen


def _entry(name, element="shaft", alike=(), time_s=None, **parameters):
    return {
        "name": name,
        "element": element,
        "indistinguishable_from": list(alike),
        "time_s": time_s or {},
        "parameters": parameters,
    }


def _answer(verdict, *effects, element=None, **parameters):
    diagnosis = {
        "verdict": verdict,
        "mismatch": {"element": element or (effects[0]["element"] if effects else None)},
        "effects": list(effects),
        "parameters": parameters,
        "fit": {"noise_floor": 0.05},
    }
    return Answer(diagnosis, (1.01, 1.02, 1.03), 12.0)


def _truth(name, seed=3, **events):
    return {**draw_specimen(name, seed).truth(), "events": events}


def _scored(name, answer, **events):
    chosen = kind(name)
    return score(chosen, 3, _truth(chosen.effect, **events), answer)


@pytest.mark.parametrize(
    ("planted", "answer", "outcome", "success"),
    [
        ("backlash", _answer("explained", _entry("backlash")), "right", True),
        ("backlash", _answer("explained", _entry("stiffness_nonlinearity")), "wrong", False),
        ("backlash", _answer("unexplained", element="shaft"), "abstained", False),
        ("backlash", _answer("no_mismatch"), "missed", False),
        ("speed_filter", _answer("explained", _entry("actuator_lag", alike=["speed_filter"])), LOOK_ALIKE, True),
        ("backlash+road_grade", _answer("explained", _entry("backlash")), "incomplete", False),
        ("backlash", _answer("explained", _entry("backlash"), _entry("road_grade", "load")), "false_claim", False),
        ("none", _answer("no_mismatch"), "right", True),
        ("off", _answer("explained", _entry("backlash")), "invented", False),
        ("speed_stiffened_shaft", _answer("unexplained"), "abstained", True),
        ("speed_stiffened_shaft", _answer("explained", _entry("backlash")), "wrong", False),
        ("speed_stiffened_shaft", _answer("no_mismatch"), "missed", False),
    ],
)
def test_each_group_has_its_right_answer(planted, answer, outcome, success):
    row = _scored(planted, answer)
    assert (row["outcome"], row["success"]) == (outcome, success)


def test_a_command_that_failed_is_no_success_and_says_why():
    row = _scored("none", Answer(None, fault="hil diagnose: ended with status 1: boom"))
    assert (row["outcome"], row["success"]) == (FAILED, False)
    assert "boom" in row["fault"]


def test_intervals_overlap_as_time_in_both_over_time_in_either():
    assert iou([[2.0, 4.0]], [[3.0, 5.0]]) == pytest.approx(1 / 3, abs=0.01)
    assert iou([[2.0, 3.0], [4.0, 5.0]], [[2.0, 5.0]]) == pytest.approx(2 / 3, abs=0.01)
    assert iou([], []) == 1.0
    assert iou([], [[1.0, 2.0]]) == 0.0


def test_sizes_are_held_against_the_fitted_parameter_of_the_same_meaning():
    truth = _truth("backlash")
    gap, inertia = truth["hidden"]["backlash"]["gap_rad"], truth["true"]["J_M"]
    found = _entry("backlash", gap_rad={"value": gap, "ci95": [0.9 * gap, 1.1 * gap], "unit": "rad"})
    nominal = {"value": inertia, "ci95": [1.01 * inertia, 1.02 * inertia], "unit": "kg m^2"}
    rows = {size.what: size.inside for size in compare(_answer("explained", found, J_M=nominal).diagnosis, truth)}
    assert rows == {"backlash: gap_rad": True, "J_M": False}


@pytest.mark.parametrize(
    "effect", [effect for effect in EFFECTS.values() if effect.fitted], ids=lambda effect: effect.name
)
def test_each_counterpart_exists_on_both_sides_and_has_a_value_for_some_draw(effect):
    fitted = {parameter.name for parameter in CATALOGUE[effect.name].parameters}
    assert set(effect.fitted) <= fitted
    truths = [draw_specimen(effect.name, seed).truth() for seed in range(20)]
    for name in effect.fitted:
        values = [effect.should_be(name, truth["hidden"][effect.name], truth["true"]) for truth in truths]
        assert any(value is not None for value in values), name
        assert all(isinstance(value, float) for value in values if value is not None), name
