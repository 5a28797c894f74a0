"""The decision: what the free run can't do without is named, and what else is possible is not in the model."""

from __future__ import annotations

import pytest

from estimator.diagnosis.inference.decide import verdict_of
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.result import Verdict
from tests.estimator.diagnosis.one_effect import bench_with, decided, diagnosed, searched

FRICTION, GENERAL, DRAG = "coulomb_friction_motor", "stribeck_friction", "quadratic_friction"


@pytest.mark.parametrize(
    ("left", "is_named", "is_more_than_noise", "expected"),
    [
        (0.1, True, False, Verdict.EXPLAINED),
        (0.1, True, True, Verdict.PARTLY_EXPLAINED),
        (0.1, False, False, Verdict.NO_MISMATCH),
        (0.1, False, True, Verdict.UNEXPLAINED),
        (1.2, True, True, Verdict.UNEXPLAINED),
        (1.2, False, False, Verdict.UNEXPLAINED),
    ],
)
def test_nothing_is_explained_that_leaves_as_much_as_the_signal_itself(
    left: float, is_named: bool, is_more_than_noise: bool, expected: Verdict
) -> None:
    assert verdict_of(left, is_named, is_more_than_noise) is expected


@pytest.fixture(scope="module")
def friction() -> Search:
    """Dry friction at the motor, among four effects that rub or brake."""
    bench = bench_with(FRICTION, {"friction_nm": 8.0})
    return searched(bench, [FRICTION, GENERAL, DRAG, "coulomb_friction_load"])


def with_one_more(search: Search, name: str, instead: str = "") -> Search:
    """The same search, as if it had ended on a set with one law more, or with a more general one."""
    best, fits = search.best, search.fits
    larger: Hypothesis | None
    if instead:
        larger = fits.exchanged(best, instead, name)
    else:
        rough = fits.added(best, name, fits.starts(best, name))
        larger = None if rough is None else fits.finish(rough, best)
    assert larger is not None
    other = Fits(fits.model, fits.records, fits.use, fits.names, ended=dict(fits.ended))
    return Search(other, (*search.path, larger))


def test_what_the_free_run_needs_is_named_with_what_speaks_for_it(friction: Search) -> None:
    decision = decided(friction)
    (standing,) = decision.judged.named
    assert standing.name == FRICTION
    assert decision.judged.refinements == ()
    assert 0.9 < standing.necessity.least <= standing.necessity.value <= 1.0
    assert standing.evidence > 100.0
    assert decision.verdict is Verdict.EXPLAINED
    assert decision.figures.holdout_augmented < decision.figures.holdout_retuned


def test_a_law_that_the_free_run_does_without_is_a_refinement_outside_the_model(friction: Search) -> None:
    search = with_one_more(friction, DRAG)
    decision = decided(search)
    assert [each.name for each in decision.judged.named] == [FRICTION]
    (refinement,) = decision.judged.refinements
    assert refinement.name == DRAG
    assert refinement.objection
    found = diagnosed(search, decision)
    assert set(found.augmented.effects) == {FRICTION}
    assert [each.name for each in found.refinements] == [DRAG]
    assert "Not established, and not in the model: quadratic friction at the motor." in found.statement


def test_a_general_law_gives_way_to_its_special_case_where_that_does_as_well(friction: Search) -> None:
    decision = decided(with_one_more(friction, GENERAL, FRICTION))
    assert [each.name for each in decision.judged.named] == [FRICTION]


def test_a_general_law_stands_where_its_special_case_leaves_too_much() -> None:
    bench = bench_with(GENERAL, {"excess_nm": 15.0, "coulomb_nm": 5.0, "stribeck_rad_s": 2.0})
    decision = decided(searched(bench, [FRICTION, GENERAL]))
    assert [each.name for each in decision.judged.named] == [GENERAL]


def test_a_name_falls_where_a_free_form_of_another_law_does_as_well(friction: Search) -> None:
    """Nothing decides after that: it is listed, and in no model."""
    whole = decided(friction).judged.believed
    decision = decided(friction, rival=lambda _without, _name: whole)
    assert decision.judged.named == ()
    assert decision.verdict is Verdict.UNEXPLAINED
    (refinement,) = decision.judged.refinements
    assert refinement.name == FRICTION
    assert refinement.objection == "another form of a law that is there already does as well"
    assert FRICTION not in diagnosed(friction, decision).augmented.effects


def test_nothing_is_established_whose_error_does_not_fall_on_unseen_recordings(friction: Search) -> None:
    """Recordings kept out of the fits, of the same line without friction."""
    elsewhere = bench_with(DRAG, {"quadratic_nm_s2": 1e-9})
    decision = decided(friction, elsewhere.records)
    assert decision.judged.named == decision.judged.traces == ()
    assert decision.judged.believed is decision.judged.nothing
    assert decision.verdict is Verdict.UNEXPLAINED
    (refinement,) = decision.judged.refinements
    assert refinement.name == FRICTION
    assert "on samples not used for the fit from" in refinement.objection
    found = diagnosed(friction, decision)
    assert found.effects == ()
    assert found.fit.augmented == found.fit.retuned
    assert found.augmented.effects == {}
