"""What is usual in a fleet is found again, whoever is not as the others is named, and nobody else."""

import numpy as np
import pytest

from estimator.physics.model import DrivelineModel, Motion, Parameter, Structure
from hil.fleet.pooling import FALSE_RATE, Seen, Usual, change, pooled, usual, with_prior

MEAN, BETWEEN, WITHIN, STD = 8.0, 0.1, 0.2, 0.05
LINE = DrivelineModel(
    structure=Structure.ONE_MASS,
    motion=Motion.ROTATION,
    parameters={"J_M": Parameter(1.0, 0.2), "b_M": Parameter(0.5, 0.2)},
)


def fleet(vehicles: int, drives: int, rng: np.random.Generator, faulty: int = 0) -> list[Seen]:
    made = []
    for vehicle in range(vehicles):
        level = MEAN + rng.normal(0.0, BETWEEN) - (8.0 * BETWEEN if vehicle < faulty else 0.0)
        made.append(Seen(level + rng.normal(0.0, np.hypot(WITHIN, STD), drives), np.full(drives, STD)))
    return made


def test_mean_and_both_spreads_are_those_the_fleet_was_drawn_with() -> None:
    known = usual(fleet(300, 5, np.random.default_rng(1)))
    assert known.mean == pytest.approx(MEAN, abs=3.0 * BETWEEN / np.sqrt(300))
    assert known.between == pytest.approx(BETWEEN, rel=0.2)
    assert known.within == pytest.approx(WITHIN, rel=0.1)


def test_vehicles_with_a_fault_do_not_make_themselves_usual() -> None:
    seen = fleet(200, 5, np.random.default_rng(2), faulty=10)
    known = usual(seen)
    assert known.between == pytest.approx(BETWEEN, rel=0.25)
    outliers = [i for i, each in enumerate(seen) if pooled(each, known).is_outlier]
    assert set(range(10)) <= set(outliers)
    assert len(outliers) <= 12


def test_sound_vehicles_are_named_as_rarely_as_said() -> None:
    named = 0
    for seed in range(10):
        seen = fleet(200, 4, np.random.default_rng([3, seed]))
        known = usual(seen)
        named += sum(pooled(each, known).is_outlier for each in seen)
    assert named <= 12  # 4 of 2000 are expected; 13 or more in one of 10,000 such fleets
    assert FALSE_RATE == 0.002


def test_the_prior_is_what_is_missing_in_the_own_recordings() -> None:
    known = Usual(MEAN, BETWEEN, WITHIN, 50)
    one, many = (pooled(Seen(np.full(n, MEAN + 1.0), np.full(n, STD)), known) for n in (1, 400))
    variance = WITHIN**2 + STD**2
    assert one.from_fleet == pytest.approx(variance / (variance + BETWEEN**2))
    assert one.value == pytest.approx(MEAN + 1.0 - one.from_fleet)
    assert many.from_fleet < 0.05
    assert many.std < one.std < np.sqrt(variance)


def test_a_step_is_dated_and_none_is_seen_where_there_is_none() -> None:
    rng = np.random.default_rng(4)
    values = MEAN + rng.normal(0.0, WITHIN, 40)
    assert change(Seen(values, np.zeros(40)), WITHIN) is None
    values[25:] -= 4.0 * WITHIN
    found = change(Seen(values, np.zeros(40)), WITHIN)
    assert found is not None
    assert abs(found.first - 25) <= 1
    assert found.before - found.after == pytest.approx(4.0 * WITHIN, rel=0.3)
    assert change(Seen(values[:1], np.zeros(1)), WITHIN) is None


def test_a_fleet_that_is_large_enough_becomes_the_nominal_model() -> None:
    model, named = with_prior(LINE, {"J_M": Usual(2.0, 0.1, 0.0, 20), "b_M": Usual(0.7, 0.1, 0.0, 3)})
    assert named == ("J_M",)
    assert model.parameters["J_M"].value == 2.0
    assert model.parameters["J_M"].ci95 == pytest.approx((2.0 - 1.96 * 0.1, 2.0 + 1.96 * 0.1), rel=1e-3)
    assert model.parameters["b_M"] == LINE.parameters["b_M"]
