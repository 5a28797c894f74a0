"""A gap whose fit ends in one of the many small minima of its error is fitted once more from softer contacts."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from estimator.diagnosis import bench as bench_module
from estimator.diagnosis.bench import Bench
from estimator.diagnosis.hypotheses import NOTHING
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.problem import Problem
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA

GAP = frozenset({"backlash"})
WIDE = {"gap_rad": 0.06, "contact_rad": 6e-3, "pull": 0.3}


def test_gaps_caught_at_one_way_to_bounce_come_out_of_it() -> None:
    """Some do; which are caught at all depends on the last digits of the simulation."""
    came_out = []
    for gap_rad, pull in product((0.058, 0.066, 0.068), (0.2, 0.3, 0.4)):
        bench = bench_with("backlash", WIDE | {"gap_rad": gap_rad, "contact_rad": 0.1 * gap_rad, "pull": pull})
        caught = bench.fit(GAP, bench.fit(NOTHING))
        found = bench.fit_nearby(GAP)
        assert found is bench.fit(GAP)
        assert found.squares <= caught.squares
        if caught.rms > 3.0 * SIGMA and found.rms < 1.03 * SIGMA:
            came_out.append(found.value("backlash", "gap_rad") / gap_rad)
    assert came_out == pytest.approx(np.ones(len(came_out)), rel=0.002)
    assert came_out


def test_a_wide_gap_is_found_from_a_start_of_its_own() -> None:
    """From the narrower starts alone it ended at six times the noise."""
    bench = bench_with("backlash", WIDE | {"gap_rad": 0.05, "contact_rad": 5e-3})
    assert bench.fit(GAP, bench.fit(NOTHING)).rms == pytest.approx(SIGMA, rel=0.03)


def test_a_fit_is_begun_around_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several ways lead past the same fit."""
    bench = bench_with("backlash", WIDE | {"gap_rad": 0.01, "contact_rad": 1e-3})
    bench.fit(GAP, bench.fit(NOTHING))
    found = bench.fit_nearby(GAP)
    again = bench.fit_nearby(GAP)  # what gained too little for another round was not begun around yet
    monkeypatch.setattr(bench_module, "fit", lambda *_: pytest.fail("begun once more"))
    assert bench.fit_nearby(GAP) is again
    assert again.squares <= found.squares


def test_what_is_at_the_noise_stays() -> None:
    bench = bench_with("backlash", WIDE | {"gap_rad": 0.01, "contact_rad": 1e-3})
    right = bench.fit(GAP, bench.fit(NOTHING))
    assert right.rms == pytest.approx(SIGMA, rel=0.03)
    assert bench.fit_nearby(GAP).squares == pytest.approx(right.squares, rel=1e-3)


@pytest.mark.parametrize(
    ("falls", "times"), [((), 1), ((0.05,), 1), ((0.3, 0.05), 2), ((0.3,) * 9, bench_module.MOST_NEARBY)]
)
def test_it_is_done_for_as_long_as_it_helps_much(
    falls: tuple[float, ...], times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = bench_with("backlash", WIDE)
    bench.fit(GAP, bench.fit(NOTHING))
    begun: list[float] = []

    def fitted(_problem: Problem, _x: FloatArray, iterations: int) -> FitResult:
        """Each fit from a round's starts takes the same share off what that round began with."""
        had = bench.fit(GAP)
        begun.append(had.squares)
        fall = dict(enumerate(falls)).get(len(set(begun)) - 1, -0.1)
        return replace(had, x=np.nextafter(had.x, np.inf), residual=np.sqrt(1.0 - fall) * had.residual, converged=True)

    monkeypatch.setattr(bench_module, "fit", fitted)
    monkeypatch.setattr(bench_module, "polished", lambda result: result)
    bench.fit_nearby(GAP)
    assert len(set(begun)) == times
    assert len(begun) == times * len(EFFECTS["backlash"].nearby)


@pytest.mark.parametrize("name", ["coulomb_friction_motor", "backlash"])
def test_without_another_start_a_fit_is_what_it_was(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where its effect names none, and where what it names is held, as a bench holds a joint's contact."""
    bench, effects = bench_with(name, {"friction_nm": 8.0} if name != "backlash" else WIDE), frozenset({name})
    known = bench.fit(effects, bench.fit(NOTHING))
    held = [
        replace(each, low=each.start, high=each.start) if each.name in WIDE else each for each in known.problem.shared
    ]
    known = replace(known, problem=replace(known.problem, shared=tuple(held)))
    monkeypatch.setitem(bench._fits, effects, known)
    monkeypatch.setattr(bench_module, "fit", lambda *_: pytest.fail("fitted once more"))
    assert bench.fit_nearby(effects) is known


def test_a_fit_that_its_limit_ended_is_not_gone_on_with_for_another_way_to_write_it() -> None:
    """A gap is written one way: what has none is as it was, and goes on only where it is chosen."""
    bench: Bench = bench_with("backlash", WIDE | {"gap_rad": 0.01, "contact_rad": 1e-3})
    ended = replace(bench.fit(GAP, bench.fit(NOTHING)), converged=False)
    bench._fits[GAP] = ended
    assert bench.fit_retold(GAP, "backlash") is ended
