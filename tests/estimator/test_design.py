"""An experiment on paper tells hypotheses apart by as much as a fit of what it then gives does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.design import (
    Candidate,
    Open,
    _on_paper as on_paper,
    _precision as precision,
    _supposed as supposed,
    as_model,
    distance,
    expected,
    name_of,
    shown,
    widths,
)
from estimator.diagnosis.inference.descent import descended
from estimator.diagnosis.inference.disturbances import whitener_of
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import THOROUGH
from estimator.diagnosis.inference.search import search_from_nothing
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import not_fitted
from estimator.physics.layout import flat, grid_for
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import own_unknowns
from estimator.signals.record import Record
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.physics.bench import record

NAMES = ["coulomb_friction_motor", "coulomb_friction_load"]


@pytest.fixture(scope="module")
def known() -> Open:
    """Dry friction at the motor or at the load, as if either were as probable; and what none of them showed."""
    bench = bench_with(NAMES[0], {"friction_nm": 8.0})
    fits = Fits(bench.model, bench.records, bench.use, NAMES)
    best = search_from_nothing(fits).best
    other = fits.exchanged(best, *NAMES)
    assert other is not None
    candidates = tuple(Candidate(name_of(fit.effects), 0.5, fit, precision(fit)) for fit in (best, other))
    return Open(fits.model, candidates, {}, ("speed_sign_blind", "coulomb_friction_motor"))


def test_a_limit_that_is_not_there_is_left_out_of_the_model() -> None:
    bench = bench_with("torque_saturation", {"limit_m1_nm": 30.0, "limit_m2_nm": 30.0})
    fits = Fits(bench.model, bench.records, bench.use, ["torque_saturation"])
    best = search_from_nothing(fits).best
    assert not np.isfinite(list(best.result.values_of("torque_saturation").values())).all()
    model = as_model(Candidate(name_of(best.effects), 1.0, best, precision(best)), fits.model)
    assert "torque_saturation" in model.effects


def driven(known: Open, torque_nm: float, cycles: int = 400) -> Record:
    """Back and forth through standstill, as the first hypothesis lets the motor turn."""
    model = as_model(known.candidates[0], known.line)
    turns = np.where(np.arange(cycles) // 100 % 2 == 0, torque_nm, -torque_nm)
    silent = record(turns, np.zeros(cycles), name="paper")
    output = simulate(grid_for(model, [silent]), silent, flat(model), InitialCondition(0.0, 0.0, 0.0))
    return record(turns, output, name="paper")


def with_share(of: Record, share: float) -> Record:
    """The same sum of torques, so much of it from the first inverter."""
    return replace(of, torque_nm=np.outer(of.total_torque_nm, [share, 1.0 - share]))


def recorded_with_share(known: Open, share: float) -> Open:
    """The same, the recordings so far as one share of the inverters gives them."""

    def changed(candidate: Candidate) -> Candidate:
        result = candidate.fit.result
        records = tuple(with_share(each, share) for each in result.problem.records)
        problem = replace(result.problem, records=records)
        return replace(candidate, fit=replace(candidate.fit, result=replace(result, problem=problem)))

    return replace(known, candidates=tuple(map(changed, known.candidates)))


def test_both_hypotheses_are_there(known: Open) -> None:
    assert [each.name for each in known.candidates] == NAMES


def test_more_time_tells_more_and_the_right_one_becomes_surer(known: Open) -> None:
    short, long = (expected(known, driven(known, 60.0, cycles)) for cycles in (200, 800))
    assert 0.5 < short.right < long.right <= 1.0
    assert 1.0 < short.factor < long.factor


def test_what_an_experiment_promises_is_what_a_fit_to_it_finds(known: Open) -> None:
    """The rival, fitted to noise-free samples of the truth with what it knew before, is behind by the distance."""
    truth, rival = known.candidates
    paper = driven(known, 60.0)
    said = replace(paper, output=on_paper(truth, known.line, paper).outputs[0])
    before = rival.fit.result.problem
    records = [*before.records, said]
    own = [own_unknowns(rival.effects, each) for each in records]
    joint = make_problem(known.line, records, before.shared, own=own)
    begun = not_fitted(joint, np.concatenate([rival.fit.result.x, joint.local[-1].guess]))
    fitted = descended(begun, whitener_of(begun, rival.fit.sizes), THOROUGH)
    squares = [
        float(np.sum(whitener_of(each, rival.fit.sizes)(each.residual) ** 2)) for each in (fitted, rival.fit.result)
    ]
    promised = distance(truth, rival, known.line, paper)
    assert promised > 10.0
    assert promised == pytest.approx(squares[0] - squares[1], rel=0.25)


def test_values_become_better_known(known: Open) -> None:
    found = list(widths(known.candidates[0], known.line, driven(known, 60.0)))
    assert {"J_M", "J_L", "k", "coulomb_friction_motor.friction_nm"} <= {each.name for each in found}
    assert all(each.after <= each.now * (1.0 + 1e-9) for each in found)
    assert min(each.after / each.now for each in found) < 0.9


def test_what_a_reversal_shows_is_asked_of_the_catalogue(known: Open) -> None:
    assert "coulomb_friction_motor" in shown(known, driven(known, 60.0))


GAIN = "inverter_gain_mismatch"


def test_a_gain_is_shown_by_two_shares_neither_of_which_shows_it_alone(known: Open) -> None:
    halves = recorded_with_share(replace(known, untested=(GAIN,)), 0.5)
    paper = driven(known, 60.0)
    assert shown(halves, with_share(paper, 0.5)) == ()
    assert shown(halves, with_share(paper, 1.0)) == (GAIN,)


def test_what_an_experiment_hardly_tells_is_not_shown_by_it(known: Open) -> None:
    halves = recorded_with_share(replace(known, untested=(GAIN,)), 0.5)
    found = supposed(halves, GAIN)
    assert found is not None
    asked = replace(halves, supposed={GAIN: found})
    short, long = (with_share(driven(known, 60.0, cycles), 1.0) for cycles in (8, 800))
    assert shown(asked, long) == (GAIN,)
    assert shown(asked, short) == ()


def test_a_gain_that_was_not_tested_moves_the_values_by_what_it_changes_the_torque(known: Open) -> None:
    found = supposed(recorded_with_share(known, 0.5), GAIN)
    assert found is not None
    assert found.size == {"gain_m1": pytest.approx(0.9)}
    moved = [share for name, share in found.moves.items() if name in ("J_M", "k")]
    assert moved
    assert all(share == pytest.approx(-0.05, abs=0.01) for share in moved)


def test_decided_is_the_verdict_that_the_odds_do_not_contradict(known: Open) -> None:
    one, other = (replace(each, probability=p) for each, p in zip(known.candidates, (0.96, 0.04), strict=True))
    agreed = replace(known, candidates=(one, other), named=one.effects)
    assert agreed.is_decided
    assert not replace(agreed, named=frozenset()).is_decided  # the verdict names nothing
    assert replace(agreed, named=frozenset(), traces=one.effects).is_decided  # what is left out is a trace
    assert not replace(agreed, named=None).is_decided  # something has no name
    assert [each.name for each in replace(known, named=one.effects).against] == [other.name]
