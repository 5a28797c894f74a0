"""Selection: what earns its place is added, its special or general case is not, the superfluous is dropped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.evidence import VERY_STRONG, gain
from estimator.diagnosis.holdout import Examiner
from estimator.diagnosis.hypotheses import NOTHING, Bench, Effects, everything, open_hypotheses
from estimator.diagnosis.intervals import covariance, interval
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.selection import (
    MOST_EFFECTS,
    PART_FOR_DETAIL,
    PART_OF_MISMATCH,
    SIGNIFICANT,
    VISIBLE,
    Selection,
    Selector,
    Trial,
    null_inside,
)
from estimator.physics.fit import FitResult
from estimator.signals.record import Record
from tests.estimator.diagnosis.planted import SIGMA, Friction, quiet, rubbing
from tests.estimator.diagnosis.regression import of_rms
from tests.estimator.physics.bench import ONE_MASS, model

LINE = model(ONE_MASS)
COULOMB, STRIBECK = "coulomb_friction_motor", "stribeck_friction"


def silent(message: str, share: float) -> None:
    """Nobody listens."""


def selector(records: Sequence[Record], names: Sequence[str] | None = None, floor: float | None = None) -> Selector:
    found, _ = open_hypotheses(LINE, records)
    bench = Bench(LINE, records, everything(records))
    level = noise_floor(records) if floor is None else floor
    return Selector(bench, Examiner(LINE, records, ()), found if names is None else names, level, silent)


def coulomb(speed: float) -> float:
    return 12.0


def stribeck(speed: float) -> float:
    return float(8.0 + 14.0 * np.exp(-((speed / 0.8) ** 2)))


def late(records: Sequence[Record], samples: int) -> list[Record]:
    """The same motion with a torque that was read earlier than it acted."""
    return [
        replace(rec, torque_nm=np.vstack([rec.torque_nm[samples:], np.tile(rec.torque_nm[-1], (samples, 1))]))
        for rec in records
    ]


@pytest.fixture(scope="module")
def with_coulomb() -> Selection:
    return selector(rubbing(coulomb)).run()


@pytest.fixture(scope="module")
def both() -> Selection:
    return selector(late(rubbing(coulomb), 3)).run()


@pytest.fixture(scope="module")
def select() -> Selector:
    return selector(quiet(values=ONE_MASS, samples=900), floor=0.1)


class TestOneEffect:
    def test_it_is_chosen_alone(self, with_coulomb: Selection) -> None:
        assert with_coulomb.chosen == {COULOMB}
        assert with_coulomb.result.rms == pytest.approx(SIGMA, rel=0.1)

    def test_its_general_case_fits_as_well_and_is_not(self, with_coulomb: Selection) -> None:
        general = with_coulomb.trials[STRIBECK].result
        assert general.rms <= with_coulomb.result.rms * 1.01

    def test_every_effect_that_can_be_told_was_tried(self, with_coulomb: Selection) -> None:
        assert set(with_coulomb.trials) == {
            "actuator_lag",
            "transport_delay",
            COULOMB,
            STRIBECK,
            "road_grade",
        }

    def test_what_speaks_for_it_is_kept(self, with_coulomb: Selection) -> None:
        trial = with_coulomb.accepted[COULOMB]
        assert trial.failed is None
        assert trial.gain == gain(with_coulomb.retuned, with_coulomb.result)
        assert trial.gain.delta_bic > VERY_STRONG
        assert trial.holdout is not None
        assert trial.holdout.after < 0.6 * trial.holdout.before

    def test_its_probability_counts_every_hypothesis(self, with_coulomb: Selection) -> None:
        for trial in with_coulomb.trials.values():
            assert trial.p_value == min(1.0, trial.gain.p_value * len(with_coulomb.trials))

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
        retuned = select.bench.fit(NOTHING)
        chosen: Effects = frozenset({COULOMB, "actuator_lag"})
        current = select.bench.fit(chosen, select.bench.fit(frozenset({COULOMB}), retuned))
        kept, result = select._drop_superfluous(chosen, current, retuned)
        assert kept == {COULOMB}
        assert result is select.bench.fit(frozenset({COULOMB}))

    def test_a_fast_effect_is_looked_for_behind_a_slow_load(self) -> None:
        records = [
            replace(rec, output=rec.output + 0.8 * np.sin(2 * np.pi * rec.time_s / 7.0)) for rec in rubbing(coulomb)
        ]
        select = selector(records)
        behind = select._behind_profile(select.bench.fit(NOTHING))
        assert behind is not None
        assert behind.effects == {"road_grade", COULOMB}
        assert behind.gain == gain(select.bench.fit(frozenset({"road_grade"})), behind.result)

    def test_where_nothing_stands_nothing_is_looked_for(self) -> None:
        select = selector(quiet(values=ONE_MASS, samples=1200))
        assert select._behind_profile(select.bench.fit(NOTHING)) is None

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
        select = selector(records)
        select.examiner = Examiner(LINE, records, quiet((7,), ONE_MASS, 1200))
        selection = select.run()
        assert selection.trials[COULOMB].failed is None
        assert COULOMB not in selection.chosen

    def test_the_reason_of_a_failure_names_the_number(self) -> None:
        selection = selector(quiet(values=ONE_MASS, samples=1200)).run()
        lag = selection.trials["actuator_lag"]
        assert lag.failed == f"gains too little information (ΔBIC {lag.gain.delta_bic:.0f}, needs 10)"


class TestRules:
    """Single rules on fits of a given RMS and white errors."""

    def trial(self, name: str, rms: float, unknowns: int = 3) -> Trial:
        result = of_rms(rms, unknowns)
        return Trial(name, frozenset({name}), result, gain(self.RETUNED, result), None, 0.0, None)

    RETUNED = of_rms(1.0, 2)

    def test_chance_is_a_reason_to_fail(self, select: Selector) -> None:
        """A probability of 0.005 is 0.025 after five hypotheses."""
        result = of_rms(1.0, 3)
        strong = replace(gain(self.RETUNED, of_rms(0.9, 3)), delta_bic=20.0, p_value=0.005)
        p_value = strong.p_value * len(select.names)
        assert p_value > SIGNIFICANT
        failed = select._statistics_fail(COULOMB, result, strong, p_value)
        assert failed == "could be chance (p = 0.025 after 5 hypotheses)"

    @pytest.mark.parametrize(("after", "weighty"), [(0.95, True), (0.98, False), (0.1, True)])
    def test_a_share_of_the_first_mismatch_has_weight(self, select: Selector, after: float, weighty: bool) -> None:
        """1 - 0.95^2 = 9.8 % of the power, 1 - 0.98^2 = 4.0 %; the floor holds 1 %."""
        assert PART_OF_MISMATCH == 0.05
        alone = frozenset({COULOMB})
        assert select._weighty(COULOMB, alone, of_rms(after, 3), self.RETUNED, self.RETUNED) is weighty

    @pytest.mark.parametrize(
        ("before", "after", "visible"),
        [
            (0.12, 0.101, True),  # most of the rest that stands above the floor, 19 % of the RMS
            (0.12, 0.117, False),  # 2.6 % of the RMS
            (0.5, 0.47, False),  # 6 % of the RMS but a small part of what stands
        ],
    )
    def test_a_small_rest_counts_where_it_is_most_of_what_stands(
        self, select: Selector, before: float, after: float, visible: bool
    ) -> None:
        assert VISIBLE == 1.05
        assert select._visible(of_rms(before, 3), of_rms(after, 4)) is visible
        elsewhere = frozenset({COULOMB, "road_grade"})
        assert select._weighty(COULOMB, elsewhere, of_rms(after, 4), of_rms(before, 3), self.RETUNED) is visible

    def test_a_small_rest_beside_an_effect_of_the_same_element_is_its_law_written_another_way(
        self, select: Selector
    ) -> None:
        same = frozenset({"backlash", "stiffness_nonlinearity"})
        after, before = of_rms(0.101, 4), of_rms(0.12, 3)
        assert not select._weighty("stiffness_nonlinearity", same, after, before, self.RETUNED)
        assert select._weighty("stiffness_nonlinearity", same, of_rms(0.101, 4), of_rms(0.5, 3), self.RETUNED)

    def test_the_special_case_is_taken_where_the_general_one_adds_little(self, select: Selector) -> None:
        special = self.trial(COULOMB, 0.2)
        for general_rms, taken in ((0.199, special.name), (0.1, STRIBECK)):
            general = self.trial(STRIBECK, general_rms, 5)
            assert select._simpler(general, {COULOMB: special, STRIBECK: general}, self.RETUNED).name == taken

    def test_a_special_case_that_failed_is_no_alternative(self, select: Selector) -> None:
        special = replace(self.trial(COULOMB, 0.2), failed="could be chance")
        general = self.trial(STRIBECK, 0.199, 5)
        assert select._simpler(general, {COULOMB: special, STRIBECK: general}, self.RETUNED) is general

    def test_detail_must_remove_a_share_of_what_the_special_case_removed(self, select: Selector) -> None:
        special = self.trial(COULOMB, 0.2)
        removed = 1.0 - 0.2**2
        edge = np.sqrt(0.2**2 - PART_FOR_DETAIL * removed)
        assert select._earns_detail(special, self.trial(STRIBECK, 0.99 * edge, 5), self.RETUNED)
        assert not select._earns_detail(special, self.trial(STRIBECK, 1.01 * edge, 5), self.RETUNED)


class TestNull:
    def fitted(self, friction: Friction) -> FitResult:
        records = rubbing(friction)
        bench = Bench(LINE, records, everything(records))
        return bench.fit(frozenset({COULOMB}), bench.fit(NOTHING))

    def test_an_interval_that_excludes_the_null_tells(self) -> None:
        assert not null_inside(COULOMB, self.fitted(coulomb))

    def test_an_effect_that_is_not_there_includes_it(self) -> None:
        result = self.fitted(lambda speed: 0.0)
        index = [(s.effect, s.name) for s in result.problem.shared].index((COULOMB, "friction_nm"))
        low, high = interval(result, covariance(result), index)
        assert null_inside(COULOMB, result)
        assert low <= 0.0 <= high

    def test_a_profile_has_no_single_null(self) -> None:
        assert not null_inside("road_grade", self.fitted(coulomb))

    def test_it_is_a_reason_to_fail(self) -> None:
        result = self.fitted(lambda speed: 0.0)
        strong = replace(gain(of_rms(1.0, 2), of_rms(0.5, 3)), delta_bic=50.0, p_value=1e-9)
        failed = selector(quiet(values=ONE_MASS, samples=600))._statistics_fail(COULOMB, result, strong, 1e-8)
        assert failed == "its interval includes the value at which it does nothing"
