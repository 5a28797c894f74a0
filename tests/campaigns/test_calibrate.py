"""Thresholds are counted from worlds, and written where they are read with everything next to them."""

import tomllib

import pytest

from estimator.diagnosis.result import Counted
from estimator.diagnosis.thresholds import THRESHOLDS, THRESHOLDS_FILE
from tests.campaigns.calibrate import FEWEST_NAMES, World, counted, divisor_of, limits_of, written
from tests.campaigns.worlds import Row

TEXT = THRESHOLDS_FILE.read_text(encoding="utf-8")
TESTS = {"most_predictable": 0.1, "most_dependent": 0.001, "most_line": 30.0, "most_change": 6.0}


def world(there: str, claims: list[tuple[list[str], bool]], line: float = 30.0, behind: float = 20.0) -> World:
    scores: list[tuple[list[str], float]] = [([], behind), (["lag"], 0.0)]
    return World("clean", 1, there, [there], claims, scores, TESTS | {"most_line": line})


LAG: tuple[list[str], bool] = (["lag", "filter"], True)


def row(*names: tuple[float | None, bool]) -> Row:
    return {"names": [{"least": least, "is_there": is_there} for least, is_there in names]}


def test_names_are_counted_by_how_much_they_are_needed_at_least() -> None:
    rows = [row((0.6, True), (0.6, False), (None, True))] + FEWEST_NAMES * [row((0.8, True))] + [row((0.95, False))]
    assert counted(rows) == [(0.0, Counted(1, 2)), (0.7, Counted(FEWEST_NAMES, FEWEST_NAMES + 1))]


def test_the_limits_of_noise_are_those_of_worlds_of_which_all_is_explained() -> None:
    """A name that a look-alike stands for is right; a false one, or none, makes a world count for nothing."""
    explained = [world("lag", [LAG]), world("filter", [LAG, (["brake"], False)])]
    others = [world("brake", [LAG], line=90.0), world("lag", [LAG, (["brake"], True)], 90.0), world("lag", [], 90.0)]
    found = limits_of([*explained, *others])
    assert found == pytest.approx({**TESTS, "most_dependent": 0.015})  # what other forms of law leave


def test_scores_count_for_less_where_claims_are_false() -> None:
    right, wrong = [world("lag", [LAG])] * 20, [world("brake", [LAG])] * 20
    assert divisor_of(right) < divisor_of(right + wrong)


def test_what_is_written_is_read_with_all_that_stood_next_to_it() -> None:
    counts = [(0.0, Counted(3, 4)), (0.9, Counted(20, 20))]
    new = tomllib.loads(written(TEXT, {"most_line": 12.345, "tempered": 5.0}, counts))
    assert new["counted"] == [
        {"necessity_from": 0, "right": 3, "of": 4},
        {"necessity_from": 0.9, "right": 20, "of": 20},
    ]
    assert (new["noise"]["most_line"], new["odds"]["tempered"]) == (12.3, 5.0)
    same = tomllib.loads(written(TEXT, {}))
    assert same == THRESHOLDS
    assert {key: new[key] for key in ("least_necessity", "course")} == {
        key: same[key] for key in ("least_necessity", "course")
    }
    assert written(TEXT, {}) == TEXT
