"""Where a selection is in doubt, others that begin with other effects are looked at."""

from __future__ import annotations

from dataclasses import replace

import pytest

from estimator.diagnosis.chain import read_through
from estimator.diagnosis.hypotheses import NOTHING, Effects
from estimator.diagnosis.search import search
from estimator.diagnosis.selection import Selection, Selector
from estimator.diagnosis.selection.selector import OTHER_WAYS, _Path
from estimator.diagnosis.trial import Trial
from estimator.physics.fit import FitResult
from tests.estimator.diagnosis.planted import quiet, rubbing
from tests.estimator.diagnosis.selection.mass import COULOMB, LINE, coulomb, late, selector, silent
from tests.estimator.physics.bench import ONE_MASS

BOTH = frozenset({COULOMB, "transport_delay"})


def nothing_of(selection: Selection) -> Selection:
    """As if no effect had passed alone."""
    return replace(selection, chosen=NOTHING, result=selection.retuned, accepted={})


@pytest.fixture(scope="module")
def searched() -> tuple[Selector, Selection]:
    select = selector(late(rubbing(coulomb), 3))
    return select, select.run()


@pytest.fixture
def select(searched: tuple[Selector, Selection], monkeypatch: pytest.MonkeyPatch) -> Selector:
    """With the fits of the search alone: what a test finds a hair better is no other's."""
    bench = searched[0].jury.bench
    monkeypatch.setattr(bench, "_fits", dict(bench._fits))
    return searched[0]


@pytest.fixture
def found(searched: tuple[Selector, Selection]) -> Selection:
    return searched[1]


def test_two_of_which_none_passed_alone_are_found_together(select: Selector, found: Selection) -> None:
    other = select.by_other_ways(nothing_of(found))
    assert other.chosen == BOTH
    assert other.result.rms == pytest.approx(found.result.rms, rel=1e-3)
    assert set(other.accepted) == BOTH


def test_a_profile_that_imitated_them_is_left_out(select: Selector, found: Selection) -> None:
    """It leaves as little, and takes all its knots for that."""
    assert found.accepted
    bent = select.jury.bench.fit(frozenset({"road_grade"}), found.retuned)
    alike = replace(bent, residual=found.result.residual)
    imitated = replace(found, chosen=frozenset({"road_grade"}), result=alike, accepted={})
    assert select.by_other_ways(imitated).chosen == BOTH


def test_what_bends_beside_others_gives_way_to_a_law(select: Selector, found: Selection) -> None:
    """A road in the place of dry friction. Where that has no name here, a law without one shows what it is not."""
    late_and_road = frozenset({"road_grade", "transport_delay"})
    delayed = select.jury.bench.fit(frozenset({"transport_delay"}), found.retuned)
    bent = _Path(late_and_road, select.jury.bench.fit(late_and_road, delayed), {})
    stiff = select._stiffened(bent, found.retuned)
    assert stiff.chosen == BOTH
    assert stiff.current.rms < bent.current.rms
    stays = selector(late(rubbing(coulomb), 3), ["road_grade", "transport_delay", "actuator_lag"])
    assert stays._stiffened(bent, found.retuned).chosen == {"transport_delay"}


def test_what_bends_stays_where_no_law_explains_the_rest_better(select: Selector, found: Selection) -> None:
    """Beside both that were hidden nothing follows a law; what follows the noise is another test's to refuse."""
    bent = _Path(BOTH | {"road_grade"}, replace(found.result, residual=0.9 * found.result.residual), {})
    assert select._stiffened(bent, found.retuned) is bent


def test_the_law_may_begin_where_what_bends_has_brought_the_others(
    select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The delay that friction's own fit has left a long way off stands right beside the road."""
    late_and_road, bench = frozenset({"road_grade", "transport_delay"}), select.jury.bench
    delayed = bench.fit(frozenset({"transport_delay"}), found.retuned)
    bent = _Path(late_and_road, bench.fit(late_and_road, delayed), {})
    right = bench.fit(BOTH)
    elsewhere = replace(right, residual=10.0 * right.residual)
    poor = replace(found.accepted[COULOMB], name=COULOMB, effects=BOTH, result=elsewhere, failed="explains nothing")
    bench._fits[BOTH] = elsewhere
    monkeypatch.setattr(select._rounds, "try_all", lambda *_: {COULOMB: poor})
    stiff = select._stiffened(bent, found.retuned)
    assert stiff.chosen == BOTH
    assert stiff.current.rms == pytest.approx(right.rms, rel=1e-3)


def test_a_way_is_completed_however_near_to_the_noise_it_ends(
    select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As long as something is left of it, and neither bends."""
    monkeypatch.setattr(select, "_is_near", lambda _: True)
    (friction,) = (
        trial for trial in select._rounds.finished_first(found.retuned, NOTHING, OTHER_WAYS) if trial.name == COULOMB
    )
    assert select._completed(friction, found.retuned, NOTHING).chosen == BOTH
    monkeypatch.setattr("estimator.diagnosis.selection.selector.flexible", lambda names: names & {COULOMB})
    assert select._completed(friction, found.retuned, NOTHING).chosen == {COULOMB}
    monkeypatch.setattr("estimator.diagnosis.selection.selector.flexible", lambda names: names - {COULOMB})
    assert select._completed(friction, found.retuned, NOTHING).chosen == {COULOMB}


def test_two_are_looked_at_once(select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the one that by itself leaves less; but a profile takes up what another would add."""
    firsts, asked = select._rounds.finished_first(found.retuned, NOTHING, OTHER_WAYS), []

    def completed(first: Trial, retuned: FitResult, without: Effects) -> _Path:
        asked.append(without)
        return _Path(NOTHING, retuned, {})

    monkeypatch.setattr(select, "_completed", completed)
    select.by_other_ways(nothing_of(found))
    names = [first.name for first in firsts]
    assert {"road_grade", COULOMB} <= set(names)
    assert asked == [frozenset(names[:i]) - {"road_grade"} for i in range(len(names))]


def test_another_way_begins_with_what_leaves_least_and_what_is_far_behind_is_not_finished(
    select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds, fit, finished = select._rounds, select.jury.bench.fit, list[Effects]()

    def noted(effects: Effects, warm: FitResult | None = None) -> FitResult:
        if warm is not None:
            finished.append(effects)
        return fit(effects, warm)

    monkeypatch.setattr(select.jury.bench, "fit", noted)
    alone = [name for name, trial in rounds.trials.items() if len(trial.effects) == 1]
    (best,) = rounds.finished_first(found.retuned, NOTHING, 1)
    assert best.result.squares == min(fit(frozenset({name}), found.retuned).squares for name in alone)
    assert 1 <= len(finished) < len(alone)
    (next_best,) = rounds.finished_first(found.retuned, frozenset({best.name}), 1)
    assert next_best.name != best.name


def test_what_is_better_stays(select: Selector, found: Selection) -> None:
    assert select.by_other_ways(found) is found


def test_a_way_from_nothing_must_end_near_the_noise() -> None:
    """Friction alone explains a part; without the delay among the hypotheses it is no explanation."""
    select = selector(late(rubbing(coulomb), 12), [COULOMB, "quadratic_friction"])
    found = select.run()
    other = select.by_other_ways(nothing_of(found))
    assert other.chosen == NOTHING


def test_doubt_is_what_another_way_is_looked_for_in(monkeypatch: pytest.MonkeyPatch) -> None:
    run = Selector.run
    monkeypatch.setattr(Selector, "run", lambda self: nothing_of(run(self)))
    assert search(read_through(late(rubbing(coulomb), 3)), LINE, (), silent).selection.chosen == BOTH


def test_where_nothing_stands_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing chosen is no doubt where no law finds anything."""
    monkeypatch.setattr(Selector, "by_other_ways", lambda *_: pytest.fail("looked for another way"))
    found = search(read_through(quiet(values=ONE_MASS, samples=1200)), LINE, (), silent)
    assert found.selection.chosen == NOTHING


def test_what_bends_and_leaves_a_law_may_imitate(select: Selector, found: Selection) -> None:
    """Near the noise, by an event or a profile, and some law finds something there: all three."""
    braked, far = frozenset({"brake_drag"}), found.retuned
    assert select.may_imitate(replace(found, chosen=braked, remaining=found.unnamed))
    assert not select.may_imitate(replace(found, chosen=braked, remaining=None))
    assert not select.may_imitate(replace(found, chosen=braked, remaining=found.unnamed, result=far))
    assert not select.may_imitate(replace(found, remaining=found.unnamed))
