"""A gap whose fit ends in one of the many small minima of its error is fitted once more in short stretches."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from estimator.diagnosis import bench as bench_module
from estimator.diagnosis.bench import MOST_SHOTS, WORTH_ANOTHER_FIT, Bench
from estimator.diagnosis.hypotheses import NOTHING, everything
from estimator.diagnosis.shooting import LEAST_SAMPLES, MOST_STRETCHES, can_be_shot, shot, stretches
from estimator.physics.fit import FitResult
from estimator.physics.kernel import state_vector
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import start_of
from estimator.physics.simulate import simulate
from estimator.signals.record import Record
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA

GAP = frozenset({"backlash"})
WIDE = {"gap_rad": 0.06, "contact_rad": 6e-3, "pull": 0.3}


@pytest.mark.parametrize("pull", [0.2, 0.3, 0.4])
@pytest.mark.parametrize("gap_rad", [0.062, 0.066, 0.07])
def test_a_gap_caught_at_one_way_to_bounce_comes_out_of_it(gap_rad: float, pull: float) -> None:
    """By themselves most of these fits end far above the noise."""
    bench = bench_with("backlash", WIDE | {"gap_rad": gap_rad, "contact_rad": 0.1 * gap_rad, "pull": pull})
    bench.fit(GAP, bench.fit(NOTHING))
    found = bench.fit_in_stretches(GAP)
    assert found is bench.fit(GAP)
    assert found.rms == pytest.approx(SIGMA, rel=0.03)
    assert found.value("backlash", "gap_rad") == pytest.approx(gap_rad, rel=0.002)


def test_a_wide_gap_is_found_from_a_start_of_its_own() -> None:
    """From the narrower starts alone it ended at six times the noise."""
    bench = bench_with("backlash", WIDE | {"gap_rad": 0.05, "contact_rad": 5e-3})
    assert bench.fit(GAP, bench.fit(NOTHING)).rms == pytest.approx(SIGMA, rel=0.03)


@pytest.fixture
def small() -> Bench:
    """A gap that is fitted right at once."""
    bench = bench_with("backlash", WIDE | {"gap_rad": 0.01, "contact_rad": 1e-3})
    bench.fit(GAP, bench.fit(NOTHING))
    return bench


def test_a_fit_is_begun_anew_once(small: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """Several ways lead past the same fit."""
    found = small.fit_in_stretches(GAP)
    again = small.fit_in_stretches(GAP)  # what gained too little for another round was not begun anew yet
    monkeypatch.setattr(bench_module, "shot", lambda *_: pytest.fail("begun once more"))
    assert small.fit_in_stretches(GAP) is again
    assert again.squares <= found.squares


def test_what_is_at_the_noise_stays(small: Bench) -> None:
    right = small.fit(GAP)
    assert right.rms == pytest.approx(SIGMA, rel=0.03)
    assert small.fit_in_stretches(GAP).squares == pytest.approx(right.squares, rel=1e-3)


@pytest.mark.parametrize(("falls", "times"), [((), 1), ((0.05,), 1), ((0.3, 0.05), 2), ((0.3,) * 9, MOST_SHOTS)])
def test_it_is_done_for_as_long_as_it_helps_much(
    falls: tuple[float, ...], times: int, small: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[float] = []

    def one_less(had: FitResult, _line: DrivelineModel) -> FitResult:
        fall = dict(enumerate(falls)).get(len(begun), -0.1)
        begun.append(had.squares)
        return replace(had, x=np.nextafter(had.x, np.inf), residual=np.sqrt(1.0 - fall) * had.residual)

    monkeypatch.setattr(bench_module, "shot", one_less)
    monkeypatch.setattr(bench_module, "polished", lambda result: result)
    small.fit_in_stretches(GAP)
    assert len(begun) == times
    assert [after / before for before, after in pairwise(begun)] == pytest.approx(
        [1.0 - fall for fall in falls[: times - 1] if fall > WORTH_ANOTHER_FIT]
    )


def test_where_nothing_bounces_a_fit_is_what_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    bench, effects = bench_with("coulomb_friction_motor", {"friction_nm": 8.0}), frozenset({"coulomb_friction_motor"})
    known = bench.fit(effects, bench.fit(NOTHING))
    monkeypatch.setattr(bench_module, "shot", lambda *_: pytest.fail("begun once more"))
    assert bench.fit_in_stretches(effects) is known


def test_stretches_begin_in_the_state_the_line_is_in(small: Bench) -> None:
    """But for the speed: that is measured."""
    right = small.fit(GAP)
    parts = stretches(right, small.model)
    for part in parts:
        problem, row = right.problem, part.rows.start
        record, begun = problem.records[part.index], start_of(problem, right.x, part.index)
        states = {
            state: simulate(problem.grid, record, right.p, begun, output=state)[row]
            for state in (state_vector.TWIST, state_vector.LOAD_SPEED)
        }
        assert part.start.twist_rad == pytest.approx(states[state_vector.TWIST])
        assert part.start.load_speed_rad_s == pytest.approx(states[state_vector.LOAD_SPEED])
        assert part.start.speed_rad_s == record.output[row]
        assert part.start.load_torque_nm == begun.load_torque_nm


def repeated(record: Record, times: int) -> Record:
    """Return a recording several times over."""
    time_s = record.sample_time_s * np.arange(times * record.time_s.size)
    torque_nm, output, okay = (
        np.concatenate([each] * times) for each in (record.torque_nm, record.output, record.okay)
    )
    return replace(record, time_s=time_s, torque_nm=torque_nm, output=output, okay=okay)


def test_stretches_are_spread_over_all_recordings_each_from_its_beginning(small: Bench) -> None:
    right = small.fit(GAP)
    parts = stretches(right, small.model)
    long = [repeated(record, 9) for record in small.records]
    bench = Bench(small.model, long, everything(long))
    many = stretches(bench.fit(NOTHING), small.model)
    lengths = [part.rows.stop - part.rows.start for part in (*parts, *many)]
    assert max(lengths) <= 1.05 * min(lengths)
    assert MOST_STRETCHES - 1 <= len(many) <= MOST_STRETCHES + 1 < 9 * len(parts)
    for found in (parts, many):
        assert [part.rows.start for part in found if part.rows.start == 0] == [0, 0]
    assert max(part.rows.stop for part in many) == long[0].time_s.size


def test_a_stretch_has_samples_that_count(small: Bench) -> None:
    few = [np.arange(record.time_s.size) < LEAST_SAMPLES for record in small.records]
    masked = Bench(small.model, small.records, few)
    assert [part.rows.start for part in stretches(masked.fit(NOTHING), small.model)] == [0, 0]


def test_no_recording_is_left_without_a_beginning_by_gaps_in_it(small: Bench) -> None:
    """Where nothing counts in its first stretch, a recording begins as it did."""
    late = [np.arange(record.time_s.size) >= 300 for record in small.records]
    masked = Bench(small.model, small.records, late)
    had = masked.fit(GAP, masked.fit(NOTHING))
    assert all(part.rows.start > 0 for part in stretches(had, small.model))
    assert shot(had, small.model).squares == pytest.approx(had.squares, rel=0.1)


def test_what_stands_over_a_whole_recording_cannot_be_begun_anew(small: Bench) -> None:
    """A load profile, and phases; a line without a shaft has no state but its speed, and no gap."""
    assert can_be_shot(small.fit(GAP))
    for name in ("road_grade", "torque_ripple"):
        assert not can_be_shot(small.fit(GAP | {name}, small.fit(GAP)))


def test_a_fit_that_its_limit_ended_is_not_gone_on_with_for_another_way_to_write_it(small: Bench) -> None:
    """A gap is written one way: what has none is as it was, and goes on only where it is chosen."""
    ended = replace(small.fit(GAP), converged=False)
    small._fits[GAP] = ended
    assert small.fit_retold(GAP, "backlash") is ended
