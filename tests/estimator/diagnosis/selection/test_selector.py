"""Selection: what earns its place is added, its special or general case is not, the superfluous is dropped."""

from __future__ import annotations

from dataclasses import replace

import pytest

from estimator.diagnosis.evidence import VERY_STRONG, gain, information
from estimator.diagnosis.holdout import Examiner
from estimator.diagnosis.hypotheses import NOTHING, Effects, open_hypotheses
from estimator.diagnosis.screening import Screen
from estimator.diagnosis.selection import Selection, Selector
from estimator.diagnosis.selection.rounds import MOST_FITS, WORTH_FITTING
from estimator.diagnosis.selection.selector import MOST_EFFECTS, PART_OF_REST, _Path
from estimator.diagnosis.trial import Trial
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from tests.estimator.diagnosis.planted import SIGMA, quiet, rubbing
from tests.estimator.diagnosis.regression import of_rms
from tests.estimator.diagnosis.selection.mass import (
    COULOMB,
    LINE,
    STRIBECK,
    coulomb,
    jury,
    lagged,
    late,
    quadratic,
    selector,
    silent,
    stribeck,
    twice_lagged,
)
from tests.estimator.physics.bench import ONE_MASS


@pytest.fixture(scope="module")
def with_coulomb() -> Selection:
    return selector(rubbing(coulomb)).run()


@pytest.fixture(scope="module")
def both() -> Selection:
    return selector(late(rubbing(coulomb), 3)).run()


class TestOneEffect:
    def test_it_is_chosen_alone(self, with_coulomb: Selection) -> None:
        assert with_coulomb.chosen == {COULOMB}
        assert with_coulomb.result.rms == pytest.approx(SIGMA, rel=0.1)

    def test_its_general_case_fits_as_well_and_is_not(self, with_coulomb: Selection) -> None:
        general = with_coulomb.trials[STRIBECK].result
        assert general.rms <= with_coulomb.result.rms * 1.01

    def test_every_effect_that_can_be_told_was_fitted_or_dismissed(self, with_coulomb: Selection) -> None:
        names, _ = open_hypotheses(LINE, rubbing(coulomb))
        assert set(with_coulomb.trials) | set(with_coulomb.dismissed) == set(names)
        assert not set(with_coulomb.trials) & set(with_coulomb.dismissed)
        assert len(with_coulomb.trials) <= MOST_FITS

    def test_dismissed_is_what_promised_little_next_to_the_best(self, with_coulomb: Selection) -> None:
        """The shares are what a first look at each finds. What fits is left out where there is too much that could."""
        screen = Screen(with_coulomb.retuned, LINE)
        promises = {name: screen.looks(name)[0].promise for name in (*with_coulomb.trials, *with_coulomb.dismissed)}
        fitted = [promises[name] for name in with_coulomb.trials if name not in (STRIBECK, "road_grade")]
        assert max(fitted) == promises[COULOMB]
        for name, share in with_coulomb.dismissed.items():
            assert share == pytest.approx(max(promises[name], 0.0) / with_coulomb.retuned.squares)
            crowded_out = len(with_coulomb.trials) == MOST_FITS and promises[name] <= min(fitted)
            assert promises[name] < WORTH_FITTING * max(fitted) or crowded_out

    def test_what_speaks_for_it_is_kept(self, with_coulomb: Selection) -> None:
        trial = with_coulomb.accepted[COULOMB]
        assert trial.failed is None
        assert trial.gain == gain(with_coulomb.retuned, with_coulomb.result)
        assert trial.gain.delta_bic > VERY_STRONG
        assert trial.holdout is not None
        assert trial.holdout.after < 0.6 * trial.holdout.before

    def test_its_probability_counts_every_hypothesis(self, with_coulomb: Selection) -> None:
        """Dismissed or fitted: each might have been the one. An event's place is chosen on top of that."""
        names, _ = open_hypotheses(LINE, rubbing(coulomb))
        for trial in with_coulomb.trials.values():
            if not EFFECTS[trial.name].event:
                assert trial.p_value == min(1.0, trial.gain.p_value * len(names))

    def test_the_general_case_supersedes_it_where_the_data_pay(self) -> None:
        selection = selector(rubbing(stribeck, sigma=0.05)).run()
        assert selection.chosen == {STRIBECK}
        assert selection.result.value(STRIBECK, "coulomb_nm") == pytest.approx(8.0, rel=0.1)
        assert selection.result.rms < 0.9 * selection.trials[COULOMB].result.rms


class TestSeveralEffects:
    def test_both_are_found_and_sized(self, both: Selection) -> None:
        assert both.chosen == {COULOMB, "transport_delay"}
        assert both.result.value(COULOMB, "friction_nm") == pytest.approx(12.0, rel=0.1)
        assert both.result.value("transport_delay", "delay_s") == pytest.approx(0.03, rel=0.1)

    def test_each_is_judged_against_the_other_alone(self, both: Selection) -> None:
        for name, trial in both.accepted.items():
            assert trial.effects == both.chosen
            (other,) = both.chosen - {name}
            assert trial.gain.delta_bic > VERY_STRONG
            assert trial.holdout is not None
            assert trial.holdout.before > trial.holdout.after
            assert other in both.accepted

    def test_what_another_made_superfluous_is_dropped(self) -> None:
        select = selector(rubbing(coulomb))
        retuned = select.jury.bench.fit(NOTHING)
        chosen: Effects = frozenset({COULOMB, "actuator_lag"})
        current = select.jury.bench.fit(chosen, select.jury.bench.fit(frozenset({COULOMB}), retuned))
        kept, result = select._drop_superfluous(chosen, current, retuned)
        assert kept == {COULOMB}
        assert result is select.jury.bench.fit(frozenset({COULOMB}))

    def test_a_general_law_that_came_to_its_special_case_is_told_as_that(self) -> None:
        """Dry friction without a breakaway, named with one before the delay of the torque was known."""
        select = selector(late(rubbing(coulomb), 3))
        bench = select.jury.bench
        retuned, general = bench.fit(NOTHING), frozenset({STRIBECK})
        friction = bench.fit(general, retuned)
        path = _Path(general, friction, {STRIBECK: select.jury.trial(STRIBECK, general, retuned, friction)})
        whole = bench.fit(general | {"transport_delay"}, friction)
        best = select.jury.trial("transport_delay", general | {"transport_delay"}, friction, whole)
        simple = select._with(path, best, retuned)
        assert simple.chosen == set(simple.accepted) == {COULOMB, "transport_delay"}
        assert simple.current.rms == pytest.approx(SIGMA, rel=0.1)

    @pytest.mark.parametrize(
        ("chosen", "left", "part"),
        [
            (set(), 0.5, 0.0),
            ({COULOMB}, 0.5, PART_OF_REST),
            ({COULOMB}, 0.14, 0.0),
            ({COULOMB, "actuator_lag"}, 0.16, PART_OF_REST),
            ({COULOMB, "actuator_lag"}, 0.18, (0.18**2 - 0.15**2) / (0.18**2 - 0.1**2)),
            ({COULOMB, "actuator_lag"}, 0.3, 0.5),
            ({COULOMB, "actuator_lag"}, 0.5, 0.5),
            ({COULOMB, "road_grade"}, 0.3, 0.0),
            ({COULOMB, "road_grade"}, 0.5, 0.5),
        ],
    )
    def test_a_further_effect_must_promise_a_part_of_the_rest(
        self, monkeypatch: pytest.MonkeyPatch, chosen: set[str], left: float, part: float
    ) -> None:
        """Half of it where two leave too much, or what comes near the noise: of a mismatch of 1, 0.1 is noise."""
        select, asked = Selector(jury(quiet(values=ONE_MASS, samples=600), floor=0.1), silent), []

        def nothing_fitted(chosen: Effects, current: FitResult, without: Effects, least: float) -> dict[str, Trial]:
            asked.append(least)
            return {}

        monkeypatch.setattr(select._rounds, "try_all", nothing_fitted)
        monkeypatch.setattr(select, "_has_rest", lambda *_: True)
        monkeypatch.setattr(select, "_outdone", lambda *_: NOTHING)
        monkeypatch.setattr(select._surveys, "may_be_one_law", lambda *_: False)
        path = _Path(frozenset(chosen), of_rms(left, 4), {})
        assert select._grown(path, of_rms(1.0, 2), far=True) is path
        assert asked == pytest.approx([part * 2000 * (left**2 - 0.1**2)])

    def test_there_is_an_end(self) -> None:
        assert 1 <= MOST_EFFECTS <= 6


class TestNothing:
    @pytest.mark.parametrize("seed", range(1, 7))
    def test_is_chosen_where_nothing_is_missing(self, seed: int) -> None:
        selection = selector(quiet((seed, seed + 50), ONE_MASS, 1200)).run()
        assert selection.chosen == NOTHING
        assert selection.result is selection.retuned
        assert selection.accepted == {}

    def test_is_chosen_where_unseen_recordings_do_not_show_it(self) -> None:
        """Friction in every recording of the fit and in none that was kept out."""
        records = rubbing(coulomb)
        unseen = Examiner(LINE, records, quiet((7,), ONE_MASS, 1200))
        selection = Selector(replace(jury(records), examiner=unseen), silent).run()
        assert selection.trials[COULOMB].failed is None
        assert COULOMB not in selection.chosen

    def test_the_reason_of_a_failure_names_the_number(self) -> None:
        selection = selector(quiet(values=ONE_MASS, samples=1200)).run()
        road = selection.trials["road_grade"]
        assert road.failed == f"gains too little information (ΔBIC {road.gain.delta_bic:.0f}, needs 10)"


class TestLookalikes:
    """Drag at the motor and drag at the load are the same where there is only one mass."""

    @pytest.fixture(scope="class")
    @staticmethod
    def dragging() -> Selection:
        return selector(quadratic(1.5), ["quadratic_friction", "aerodynamic_drag", COULOMB, "actuator_lag"]).run()

    def test_what_explains_as_well_is_declared(self, dragging: Selection) -> None:
        (chosen,) = dragging.chosen
        (other,) = {"quadratic_friction", "aerodynamic_drag"} - {chosen}
        assert dragging.lookalikes == {chosen: (other,)}

    def test_of_what_leaves_too_much_to_be_named_none_is_sought(self) -> None:
        """Drag that grows with the square of the speed leaves a fifth of what dry friction does."""
        select = selector(rubbing(coulomb), ["quadratic_friction", "aerodynamic_drag"])
        retuned, drag = select.jury.bench.fit(NOTHING), frozenset({"quadratic_friction"})
        path = _Path(drag, select.jury.bench.fit(drag, retuned), {})
        assert not select.jury.weight.may_stand(path.current, retuned)
        assert select._concluded(path, retuned).lookalikes == {}

    def test_a_relative_that_explains_less_is_not(self, with_coulomb: Selection) -> None:
        """Quadratic friction resembles it, and Stribeck's law contains it."""
        assert with_coulomb.lookalikes == {COULOMB: ()}

    def test_what_is_worse_by_next_to_nothing_is(self) -> None:
        """Two lags of 2.4 ms in a row are told from a delay beyond chance, and by next to nothing."""
        late = {"actuator_lag", "speed_filter", "transport_delay"}
        selection = selector(twice_lagged(0.0024, sigma=0.1 * SIGMA), [*sorted(late), COULOMB]).run()
        (chosen,) = selection.chosen
        (rival,) = late - {chosen, "speed_filter"}
        n = gain(selection.retuned, selection.result).n_effective
        assert information(selection.trials[rival].result, selection.result, n) > VERY_STRONG
        assert {chosen, *selection.lookalikes[chosen]} == late

    def test_what_is_the_same_by_its_equation_always_is(self) -> None:
        """Here it was no hypothesis at all."""
        selection = selector(lagged(0.04), ["actuator_lag", COULOMB]).run()
        assert selection.lookalikes == {"actuator_lag": ("speed_filter",)}
