"""The last metres to an event's moments: a fit that ended in a neighbouring optimum comes out of it.

The recording is simulated by the law that is fitted: what is tested is the search.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimator.physics import fit as fit_module
from estimator.physics.fit import FitResult, fit
from estimator.physics.grid import grid_for
from estimator.physics.layout import flat, slot
from estimator.physics.least_squares import Solution, minimise
from estimator.physics.moments import OFFSETS_S, without_idle
from estimator.physics.polish import polished
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.start import Start
from estimator.physics.unknowns import Shared, own_unknowns
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, record

SIGMA = 0.02
SAMPLES = 900
FROM_S, TO_S = 2.5, 6.0
LINE = model(TWO_MASS, tolerance=0.0, effects={"stiffness_change": {"change": -0.3}})


@pytest.fixture(scope="module")
def cracked() -> Record:
    return cracked_between(FROM_S, TO_S)


def cracked_between(from_s: float, to_s: float) -> Record:
    torque = random_steps(SAMPLES, 1, mean_nm=30.0)
    blank = record(torque, np.ones(SAMPLES))
    p = flat(LINE)
    p[slot("stiffness_change", "from_s")], p[slot("stiffness_change", "to_s")] = from_s, to_s
    clean = simulate(grid_for(LINE, [blank]), blank, p, Start(10.0, 0.0, 20.0, 0.005, 20.0))
    return record(torque, clean + SIGMA * np.random.default_rng(1).standard_normal(SAMPLES))


def ended(rec: Record, from_s: float, to_s: float, movable: bool = True) -> FitResult:
    """A fit that converged from these moments."""
    moments = {"from_s": from_s, "to_s": to_s}

    def at(unknown: Shared) -> Shared:
        start = moments[unknown.name]
        return replace(unknown, start=start) if movable else replace(unknown, start=start, low=start, high=start)

    own = [tuple(at(unknown) for unknown in own_unknowns(["stiffness_change"], rec))]
    return fit(make_problem(LINE, [rec], (), own=own))


def moments_of(result: FitResult) -> list[float]:
    return [float(value) for value in result.local_of(0)[result.problem.local[0].own_rows]]


@pytest.mark.parametrize("off_s", [-0.2, 0.05, 0.3])
def test_a_fit_that_is_stuck_nearby_comes_out(cracked: Record, off_s: float) -> None:
    """The line swings at 8 Hz: a moment that is off by a period or two looks right again."""
    stuck = ended(cracked, FROM_S + off_s, TO_S - off_s)
    assert stuck.converged
    assert stuck.rms > 2.0 * SIGMA
    result = polished(stuck)
    assert moments_of(result) == pytest.approx([FROM_S, TO_S], abs=0.005)
    assert result.rms == pytest.approx(SIGMA, rel=0.05)


@pytest.mark.parametrize(("from_s", "to_s"), [(3.0, SAMPLES / 100.0), (0.0, 6.0)])
def test_what_lasts_to_the_end_of_the_recording_is_found_however_far_that_is(from_s: float, to_s: float) -> None:
    rec = cracked_between(from_s, to_s)
    inner = max(from_s, 4.0), min(to_s, 5.0)
    stuck = ended(rec, *inner)
    assert max(abs(found - true) for found, true in zip(moments_of(stuck), (from_s, to_s), strict=True)) > OFFSETS_S[-1]
    result = polished(stuck)
    assert moments_of(result) == pytest.approx([from_s, to_s], abs=0.05)
    assert result.rms == pytest.approx(SIGMA, rel=0.05)


def test_where_a_moment_refuses_every_step_the_others_go_on_without_it(
    cracked: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    free: list[FloatArray] = []

    def stuck_at_first(*given: Any, **options: Any) -> Solution:
        free.append(given[3] < given[4])
        return replace(minimise(*given, **options), stuck=len(free) == 1)

    monkeypatch.setattr(fit_module, "minimise", stuck_at_first)
    result = ended(cracked, FROM_S + 0.001, TO_S)
    moments = [unknown.name in ("from_s", "to_s") for unknown in result.problem.local[0].own]
    every, without, again = (each[result.problem.local[0].own_rows] for each in free)
    assert all(every)
    assert all(again)
    assert not any(without[moments])
    assert free[1].sum() == free[0].sum() - sum(moments)
    assert result.rms == pytest.approx(SIGMA, rel=0.05)


def test_where_they_are_right_the_fit_stays(cracked: Record) -> None:
    best = polished(ended(cracked, FROM_S, TO_S))
    assert polished(best) is best


def test_moments_that_are_held_stay(cracked: Record) -> None:
    """A recording in which the scan found no event has none to move."""
    stuck = ended(cracked, 3.0, 3.0, movable=False)
    assert polished(stuck) is stuck


def test_it_looks_to_both_sides_as_far_as_the_scan_is_coarse() -> None:
    np.testing.assert_allclose(OFFSETS_S, -OFFSETS_S[::-1])
    assert np.max(OFFSETS_S) >= 0.5


class TestWithoutIdle:
    """A brake in one recording, and none in the other; both go forward all along."""

    BRAKE_NM = 12.0
    LINE = model(ONE_MASS, tolerance=0.05, effects={"brake_drag": {"brake_nm": BRAKE_NM}})

    def driven(self, seed: int, braked_s: tuple[float, float] | None) -> Record:
        time_s = np.arange(SAMPLES) * 0.01
        begin, end = braked_s or (0.0, 0.0)
        load = np.where((time_s >= begin) & (time_s < end), self.BRAKE_NM, 0.0)
        torque, start = random_steps(SAMPLES, seed, mean_nm=90.0), Start(5.0, 0.0, 20.0)
        return linear_record(ONE_MASS, torque, start, sigma=SIGMA, seed=seed, name=f"run_{seed}", extra_load_nm=load)

    def fitted(self, *started_s: tuple[float, float], near_s: float = 0.5) -> FitResult:
        """Fit with moments that may move by half a second, as after a scan."""
        records = [self.driven(1, (2.0, 5.0)), self.driven(2, None)]
        own = [
            tuple(
                replace(u, start=start, low=max(u.low, start - near_s), high=min(u.high, start + near_s))
                for u, start in zip(own_unknowns(["brake_drag"], rec), at, strict=True)
            )
            for rec, at in zip(records, started_s, strict=True)
        ]
        return fit(make_problem(self.LINE, records, (), own=own))

    @staticmethod
    def lasts_s(result: FitResult) -> list[float]:
        """How long the event lasts in each recording."""
        own = [result.local_of(i)[basis.own_rows] for i, basis in enumerate(result.problem.local)]
        return [float(end - begin) for begin, end in own]

    def test_an_event_all_along_is_the_load_torque_in_another_guise(self) -> None:
        result = self.fitted((2.2, 4.8), (0.0, 9.0))
        assert self.lasts_s(result) == pytest.approx([3.0, 9.0], abs=0.2)
        without = without_idle(result)
        assert self.lasts_s(without) == [pytest.approx(3.0, abs=0.05), 0.0]
        assert without.rms == pytest.approx(SIGMA, rel=0.05)

    def test_one_that_is_held_all_along_is_taken_out_as_well(self) -> None:
        held = self.fitted((2.0, 5.0), (0.0, 8.99), near_s=0.0)
        assert self.lasts_s(without_idle(held)) == [pytest.approx(3.0), 0.0]

    def test_one_of_no_weight_is_taken_out(self) -> None:
        without = without_idle(self.fitted((2.2, 4.8), (3.0, 3.05)))
        assert self.lasts_s(without)[1] == 0.0

    def test_one_that_is_over_at_once_is_taken_out_whatever_it_explains(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("estimator.physics.moments.WORTH", -math.inf)
        assert self.lasts_s(without_idle(self.fitted((2.2, 4.8), (0.0, 0.4))))[1] == 0.0
        assert self.lasts_s(without_idle(self.fitted((2.2, 4.8), (3.0, 3.4))))[1] > 0.0

    def test_one_that_is_needed_stays(self) -> None:
        result = self.fitted((2.2, 4.8), (0.0, 0.0))
        without = without_idle(result)
        assert self.lasts_s(without) == pytest.approx(self.lasts_s(result), abs=0.01)
        assert self.lasts_s(without)[0] == pytest.approx(3.0, abs=0.05)
