"""How sure a name is was counted: never surer than what was seen."""

import pytest

from estimator.diagnosis.inference import trials
from estimator.diagnosis.inference.trials import COUNTED, counted_from
from estimator.diagnosis.result import Counted


@pytest.mark.parametrize(
    ("right", "of", "expected"),
    [(9, 10, 10 / 12), (99, 100, 100 / 102), (10, 10, 11 / 12), (1, 10, 0.1), (0, 5, 0.0)],
)
def test_a_probability_is_what_a_count_shows_of_the_next_and_never_above_the_share(
    right: int, of: int, expected: float
) -> None:
    counted = Counted(right, of)
    assert counted.probability == pytest.approx(expected)
    assert counted.probability <= right / of


def test_a_name_is_counted_among_those_that_are_needed_as_surely(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trials, "COUNTED", [(0.0, Counted(1, 2)), (0.7, Counted(8, 10)), (0.9, Counted(20, 20))])
    found = [counted_from(least).right for least in (0.5, 0.7, 0.89, 0.95)]
    assert found == [1, 8, 8, 20]


def test_the_counts_that_are_given_rise_with_what_a_name_is_needed() -> None:
    least = [each for each, _ in COUNTED]
    assert least == sorted(least)
    assert least[0] == 0.0
    assert all(0 < count.right <= count.of for _, count in COUNTED)
