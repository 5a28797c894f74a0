"""Where a selection is in doubt, others that begin with other effects are looked at."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from estimator.diagnosis.chain import read_through
from estimator.diagnosis.evidence import Gain
from estimator.diagnosis.hypotheses import NOTHING, Effects
from estimator.diagnosis.search import search
from estimator.diagnosis.selection import Selection, Selector
from estimator.diagnosis.selection import selector as selector_module
from estimator.diagnosis.selection.outcome import Survey, located, survey
from estimator.diagnosis.selection.selector import OTHER_WAYS, PART_IN_PLACE, _Path
from estimator.diagnosis.trial import Trial
from estimator.diagnosis.unnamed import ROUNDS, UnnamedLaw
from estimator.physics.effect import Element
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
    """With the fits of the search alone, what a test finds a hair better is no other's; and as if no way were gone."""
    bench = searched[0].jury.bench
    monkeypatch.setattr(bench, "_fits", dict(bench._fits))
    monkeypatch.setattr(searched[0], "_gone", set())
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


def bent_by_a_road(select: Selector, found: Selection) -> _Path:
    """A road in the place of the dry friction beside the delay."""
    late_and_road, bench = frozenset({"road_grade", "transport_delay"}), select.jury.bench
    delayed = bench.fit(frozenset({"transport_delay"}), found.retuned)
    return _Path(late_and_road, bench.fit(late_and_road, delayed), {})


def test_what_bends_beside_others_gives_way_to_a_law(select: Selector, found: Selection) -> None:
    """A road in the place of dry friction. Where that has no name here, a law without one shows what it is not."""
    bent = bent_by_a_road(select, found)
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
    bench, bent = select.jury.bench, bent_by_a_road(select, found)
    right = bench.fit(BOTH)
    elsewhere = replace(right, residual=10.0 * right.residual)
    poor = replace(found.accepted[COULOMB], name=COULOMB, effects=BOTH, result=elsewhere, failed="explains nothing")
    bench._fits[BOTH] = elsewhere
    monkeypatch.setattr(select._rounds, "try_all", lambda *_: {COULOMB: poor})
    stiff = select._stiffened(bent, found.retuned)
    assert stiff.chosen == BOTH
    assert stiff.current.rms == pytest.approx(right.rms, rel=1e-3)


def test_a_law_must_promise_a_fair_part_of_what_it_is_to_explain_in_its_place(
    select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    bent = bent_by_a_road(select, found)
    asked = []

    def nothing_fitted(chosen: Effects, current: FitResult, without: Effects, least: float) -> dict[str, Trial]:
        asked.append(least / (current.squares - bent.current.squares))
        return {}

    monkeypatch.setattr(select._rounds, "try_all", nothing_fitted)
    monkeypatch.setattr(select._surveys, "law", lambda _: None)
    assert select._stiffened(bent, found.retuned) is bent
    assert asked == pytest.approx([PART_IN_PLACE])


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


@pytest.mark.parametrize("bends", [False, True])
def test_the_way_that_was_gone_is_gone_again_only_without_what_bends(
    bends: bool, select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = list[str]()

    def completed(first: Trial, retuned: FitResult, without: Effects) -> _Path:
        begun.append(first.name)
        return _Path(NOTHING, retuned, {})

    monkeypatch.setattr(select, "_gone", {COULOMB})
    monkeypatch.setattr(select, "_completed", completed)
    monkeypatch.setattr(select, "_is_near", lambda _: False)
    select.by_other_ways(replace(found, chosen=frozenset({"road_grade"})) if bends else nothing_of(found))
    assert (COULOMB in begun) is bends
    assert set(begun) - {COULOMB}


@pytest.mark.parametrize(
    ("bends", "leaves_a_law", "goes_on"), [(False, True, False), (True, False, False), (True, True, True)]
)
def test_after_a_way_that_ended_near_the_noise_others_are_gone_only_where_it_may_imitate(
    bends: bool,
    leaves_a_law: bool,
    goes_on: bool,
    select: Selector,
    found: Selection,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun = list[str]()

    def completed(first: Trial, retuned: FitResult, without: Effects) -> _Path:
        begun.append(first.name)
        return _Path(BOTH, found.result, found.accepted)

    law = UnnamedLaw(Element.LOAD, (("w_L^3", 1.0),), Gain(1e3, 1e-9, 1e3), 0.0) if leaves_a_law else None
    monkeypatch.setattr(select, "_completed", completed)
    monkeypatch.setattr(select._surveys, "law", lambda result: law)
    monkeypatch.setattr(selector_module, "flexible", lambda names: names if bends and names == BOTH else NOTHING)
    monkeypatch.setattr(select, "_grown", lambda path, retuned: path)
    monkeypatch.setattr(select, "_stiffened", lambda path, retuned: path)
    assert select.by_other_ways(nothing_of(found)).chosen == BOTH
    assert (len(begun) > 1) is goes_on


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
    assert select.by_other_ways(found).result is found.result


@pytest.mark.parametrize(
    ("left", "bends", "gone"), [(1.16, False, True), (1.14, False, False), (1.14, True, True), (math.inf, False, True)]
)
def test_where_one_law_without_a_name_explains_all_no_other_way_is_gone(
    left: float, bends: bool, gone: bool, select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for one that imitated: a profile came near the noise, and laws may do in its place."""
    doubted = replace(found, chosen=frozenset({"road_grade"})) if bends else nothing_of(found)
    level, law = select.jury.weight.level(doubted.result), None
    if math.isfinite(left):
        law = UnnamedLaw(Element.MOTOR, (("w_M^3", 1.0),), Gain(1e3, 1e-9, 1e3), left * level)
    monkeypatch.setattr(select._surveys, "_located", None)
    monkeypatch.setattr("estimator.diagnosis.selection.surveys.located", lambda *_: Survey(found.hunts, law))
    asked = list[Effects]()
    monkeypatch.setattr(select._rounds, "finished_first", lambda retuned, without, most: asked.append(without) or [])
    assert select.by_other_ways(doubted).chosen == doubted.chosen
    assert bool(asked) is gone


def test_the_search_for_its_law_goes_on_from_the_first_look_and_is_made_once(
    found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = survey(found.retuned)
    once = located(found.retuned, first)
    assert once.law is not None
    assert {hunt.rounds for hunt in once.hunts} == {ROUNDS}
    monkeypatch.setattr("estimator.diagnosis.unnamed.search.again", None)
    assert located(found.retuned, once).law == once.law
    with pytest.raises(TypeError, match="not callable"):
        located(found.retuned, first)


def test_no_law_that_chance_would_find_explains_all() -> None:
    """Of an error that is noise already any law leaves no more than the noise."""
    retuned = selector(quiet(values=ONE_MASS)).run().retuned
    assert located(retuned, survey(retuned)).law is None


def test_before_a_third_effect_a_law_is_looked_for_to_the_end(
    select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where two leave what is seen."""
    whole = UnnamedLaw(Element.MOTOR, (("w_M^3", 1.0),), Gain(1e3, 1e-9, 1e3), found.result.rms)
    monkeypatch.setattr(select._surveys, "law", lambda _: None)
    monkeypatch.setattr(select._surveys, "_located", Survey(found.hunts, whole))
    monkeypatch.setattr(selector_module, "outdone", lambda law, *_: law)
    assert select._outdone(_Path(BOTH, found.retuned, {}), found.retuned) is whole
    assert select._outdone(_Path(BOTH, found.result, {}), found.retuned) is None
    assert select._outdone(_Path(frozenset({COULOMB}), found.retuned, {}), found.retuned) is None
    assert select._outdone(_Path(NOTHING, found.retuned, {}), found.retuned) == NOTHING


@pytest.mark.parametrize(
    ("first_look", "whole", "asked"),
    [(1.4, 1.1, True), (1.4, 1.2, False), (1.6, 1.1, False), (None, 1.1, False), (1.4, None, False)],
)
def test_where_one_law_without_a_name_would_do_a_second_effect_must_promise_to_complete(
    first_look: float | None,
    whole: float | None,
    asked: bool,
    select: Selector,
    found: Selection,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is looked for to its end where a first look brings it near the noise."""
    one = _Path(frozenset({COULOMB}), select.jury.bench.fit(frozenset({COULOMB})), {})
    level = select.jury.weight.level(one.current)

    def law(times_noise: float | None) -> UnnamedLaw | None:
        if times_noise is None:
            return None
        return UnnamedLaw(Element.MOTOR, (("w_M^3", 1.0),), Gain(1e3, 1e-9, 1e3), times_noise * level)

    monkeypatch.setattr(select._surveys, "law", lambda _: law(first_look))
    monkeypatch.setattr(select._surveys, "_located", Survey(found.hunts, law(whole)))
    half = 0.5 * select._rest(one.current)
    assert (select._least_promise(one, found.retuned) == half) is asked
    nearer = replace(one, current=replace(found.result, residual=1.3 * found.result.residual))
    assert select._least_promise(nearer, found.retuned) == 0.0  # the path is nearer to the noise than a first look
    assert select._least_promise(replace(one, chosen=NOTHING), found.retuned) == 0.0


def test_on_other_steps_what_the_rest_makes_superfluous_is_dropped(found: Selection) -> None:
    select = selector(late(rubbing(coulomb), 3))
    bench, more = select.jury.bench, BOTH | {"quadratic_friction"}
    result = bench.fit_by_steps(more)
    had = dict.fromkeys(more, next(iter(found.accepted.values())))
    moved = selector(late(rubbing(coulomb), 3)).taken_over(replace(found, chosen=more, result=result, accepted=had))
    assert moved is not None
    assert moved.chosen == BOTH


def test_a_way_from_nothing_must_end_near_the_noise() -> None:
    """Friction alone explains a part; without the delay among the hypotheses it is no explanation."""
    select = selector(late(rubbing(coulomb), 12), [COULOMB, "quadratic_friction"])
    found = select.run()
    other = select.by_other_ways(nothing_of(found))
    assert other.chosen == NOTHING


@pytest.mark.parametrize(("times_noise", "taken"), [(1.0, True), (2.0, False)])
def test_any_way_must_where_a_speed_is_read(
    select: Selector, found: Selection, monkeypatch: pytest.MonkeyPatch, times_noise: float, taken: bool
) -> None:
    """However much better it is than what was chosen."""
    alone = frozenset({"actuator_lag"})
    poorer = replace(found, chosen=alone, result=select.jury.bench.fit(alone, found.retuned), accepted={})
    way = _Path(BOTH, replace(found.result, residual=times_noise * found.result.residual), found.accepted)
    assert way.current.squares < 0.5 * poorer.result.squares
    monkeypatch.setattr(select, "_completed", lambda *_: way)
    monkeypatch.setattr(select, "_stands", lambda _: True)
    assert select.by_other_ways(poorer).chosen == (BOTH if taken else alone)


def test_doubt_is_what_another_way_is_looked_for_in(monkeypatch: pytest.MonkeyPatch) -> None:
    run = Selector.run

    def forgotten(select: Selector) -> Selection:
        found = nothing_of(run(select))
        select._gone.clear()
        return found

    monkeypatch.setattr(Selector, "run", forgotten)
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
