"""Thresholds follow from worlds that were searched: enough to see that a false effect raises what must be believed."""

from __future__ import annotations

import json
import tomllib
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from estimator.diagnosis.inference.calibration import TEST_LIMITS
from hil.proof import calibrate
from hil.proof.calibrate import BELIEVED, OTHER_FORMS, Claim, Thresholds, World, calibrated, main, table, written

TESTS = {"most_predictable": 0.002, "most_dependent": 0.001, "most_line": 9.0, "most_change": 3.0}
LAX = {"most_predictable": 1.0, "most_dependent": 1.0, "most_line": 1e9, "most_change": 1e9}


def world(seed: int, gain: float = 400.0, is_there: bool = True) -> World:
    name = "backlash" if is_there else "tyre_slip"
    claims = [Claim(name, [name], 0.5)]
    scores: list[tuple[list[str], float, bool]] = [([], gain, True), ([name], 0.0, True)]
    return World("dirty", seed, "backlash", ["backlash"], claims, scores, TESTS, 9000, 2.0 + seed)


def test_limits_are_those_of_worlds_of_which_all_is_explained() -> None:
    odd = replace(world(9, is_there=False), tests=dict.fromkeys(TESTS, 100.0))
    limits = calibrated([*map(world, range(5)), odd]).limits
    assert limits["most_line"] == pytest.approx(9.0)
    assert limits["most_predictable"] == OTHER_FORMS["most_predictable"]  # within chance in these worlds


def test_where_nothing_is_false_what_is_believed_is_named() -> None:
    assert calibrated([world(i) for i in range(20)]).least_probability == BELIEVED


def test_a_false_effect_raises_the_divisor_and_what_must_be_believed() -> None:
    right = [world(i) for i in range(20)]
    wrong = [world(20 + i, gain=60.0, is_there=False) for i in range(3)]
    thresholds = calibrated([*right, *wrong])
    assert thresholds.divisor > calibrated(right).divisor
    assert not any(each.named(thresholds) for each in wrong)
    assert all(each.named(thresholds) for each in right)


def test_what_a_test_finds_counts_against_scores() -> None:
    one = world(1, gain=40.0)
    left = replace(one, tests={**TESTS, "most_predictable": 0.1})
    thresholds = Thresholds({**LAX, "most_predictable": 0.01}, 1.0, 0.9)
    assert one.probability(one.claims[0], thresholds) > 0.99
    assert left.probability(left.claims[0], thresholds) < 0.6


def test_the_table_counts_names_and_false_ones() -> None:
    rows = table([world(1), world(2), world(3, is_there=False)], Thresholds(LAX, 1.0, 0.9))
    assert "| dirty | 3 | 2 of 3 | 3 | 1 | 2 | 4.0, 5.0 |" in rows


def test_thresholds_are_written_as_they_are_read() -> None:
    read = tomllib.loads(written(Thresholds(LAX, 4.0, 0.9), "python -m hil.proof.calibrate"))
    assert read == {"tempered": 4.0, "least_probability": 0.9, **LAX}
    assert set(LAX) == set(TEST_LIMITS)


def test_worlds_that_were_searched_are_not_searched_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(calibrate, "searched", pytest.fail)
    for seed in (1, 2):
        (tmp_path / f"dirty_{seed}.json").write_text(json.dumps(asdict(world(seed))), encoding="utf-8")
    (tmp_path / "dirty_3.json").write_text("null", encoding="utf-8")  # refused
    assert main(["--sets", "dirty", "--seeds", "1..2", "--judge", "2..3", "--out", str(tmp_path)]) == 0
    assert "| dirty | 1 | 1 of 1 | 1 | 0 | 1 |" in capsys.readouterr().out
