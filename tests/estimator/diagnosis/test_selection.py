"""Selection: what earns its place is added, its special or general case is not, the superfluous is dropped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.diagnosis.evidence import VERY_STRONG, gain, information
from estimator.diagnosis.holdout import Examiner, HoldOut
from estimator.diagnosis.hypotheses import NOTHING, Bench, Effects, everything, open_hypotheses
from estimator.diagnosis.intervals import covariance, interval
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.screening import Look, Screen
from estimator.diagnosis.selection import (
    MOST_EFFECTS,
    MOST_FITS,
    SIGNIFICANT,
    WORTH_FITTING,
    Selection,
    Selector,
)
from estimator.diagnosis.trial import Trial, has_edge, healed_in, null_inside, scan_choices
from estimator.diagnosis.weight import Weight
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.own_scan import MOST_CELLS
from estimator.physics.simulate import Start
from estimator.physics.unknowns import Release
from estimator.signals.record import Record
from tests.estimator.diagnosis.planted import SIGMA, Friction, drive_torque, quiet, rubbing, rubbing_speed
from tests.estimator.diagnosis.regression import of_rms
from tests.estimator.physics.bench import ONE_MASS, linear_record, model, random_steps, record

LINE = model(ONE_MASS)
COULOMB, STRIBECK = "coulomb_friction_motor", "stribeck_friction"


def silent(message: str, share: float) -> None:
    """Nobody listens."""


def selector(records: Sequence[Record], names: Sequence[str] | None = None, floor: float | None = None) -> Selector:
    found, _ = open_hypotheses(LINE, records)
    bench = Bench(LINE, records, everything(records))
    level = noise_floor(records) if floor is None else floor
    return Selector(bench, Examiner(LINE, records, ()), found if names is None else names, Weight(level), silent)


def coulomb(speed: float) -> float:
    return 12.0


def stribeck(speed: float) -> float:
    return float(8.0 + 14.0 * np.exp(-((speed / 0.8) ** 2)))


def quadratic(coefficient: float) -> list[Record]:
    """Air drag instead of dry friction; the torque takes the speed through zero, so that it counts."""
    found = []
    for seed in (1, 2):
        torque = 4.0 * drive_torque(seed, 1200)
        speed = rubbing_speed(lambda w: coefficient * w * w, torque, Start(5.0, 0.0, 2.0))
        noise = SIGMA * np.random.default_rng(seed).standard_normal(torque.size)
        found.append(record(torque, speed + noise, name=f"run_{seed}"))
    return found


def lagged(time_constant_s: float) -> list[Record]:
    """Torque that follows its reading with a lag; the mean over each period is what moves the mass."""
    decay, found = np.exp(-0.01 / time_constant_s), []
    for seed in (1, 2):
        read = drive_torque(seed, 1200)
        behind = lfilter([0.0, 1.0 - decay], [1.0, -decay], read - read[0]) + read[0]
        true = read + (behind - read) * time_constant_s / 0.01 * (1.0 - decay)
        rec = linear_record(ONE_MASS, true, Start(5.0, 0.0, 2.0), sigma=SIGMA, seed=seed, name=f"run_{seed}")
        found.append(replace(rec, torque_nm=read[:, None]))
    return found


def twice_lagged(time_constant_s: float, sigma: float, parts: int = 10) -> list[Record]:
    """Torque behind two lags in a row, followed in parts of a period, on a mass that adds up what it gets."""
    decay, found = np.exp(-0.01 / parts / time_constant_s), []
    for seed in (1, 2):
        read = drive_torque(seed, 1200)
        behind = np.repeat(read - read[0], parts)
        for _ in range(2):
            behind = lfilter([1.0 - decay], [1.0, -decay], behind)
        true = behind.reshape(-1, parts).mean(axis=1) + read[0]
        rec = linear_record(ONE_MASS, true, Start(5.0, 0.0, 2.0), sigma=sigma, seed=seed, name=f"run_{seed}")
        found.append(replace(rec, torque_nm=read[:, None]))
    return found


BRAKE_NM = 12.0


def braked_records() -> list[Record]:
    """Forward all along; a brake drags for a while, not in the last recording."""
    time_s, found = np.arange(1200) * 0.01, []
    for seed, (begin, end) in {1: (2.0, 5.0), 2: (6.0, 9.5), 3: (0.0, 0.0)}.items():
        load = np.where((time_s >= begin) & (time_s < end), BRAKE_NM, 0.0)
        torque, start = random_steps(1200, seed, mean_nm=90.0), Start(5.0, 0.0, 20.0)
        found.append(
            linear_record(ONE_MASS, torque, start, sigma=SIGMA, seed=seed, name=f"run_{seed}", extra_load_nm=load)
        )
    return found


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

    def test_a_relative_that_explains_less_is_not(self, with_coulomb: Selection) -> None:
        """Quadratic friction resembles it, and Stribeck's law contains it."""
        assert with_coulomb.lookalikes == {COULOMB: ()}

    def test_what_is_worse_by_next_to_nothing_is(self) -> None:
        """Two lags of 3 ms in a row are told from a delay beyond chance, and by next to nothing."""
        late = {"actuator_lag", "speed_filter", "transport_delay"}
        selection = selector(twice_lagged(0.003, sigma=0.1 * SIGMA), [*sorted(late), COULOMB]).run()
        (chosen,) = selection.chosen
        (rival,) = late - {chosen, "speed_filter"}
        n = gain(selection.retuned, selection.result).n_effective
        assert information(selection.trials[rival].result, selection.result, n) > VERY_STRONG
        assert {chosen, *selection.lookalikes[chosen]} == late

    def test_what_is_the_same_by_its_equation_always_is(self) -> None:
        """Here it was no hypothesis at all."""
        selection = selector(lagged(0.04), ["actuator_lag", COULOMB]).run()
        assert selection.lookalikes == {"actuator_lag": ("speed_filter",)}


class TestEvents:
    """Intervals are chosen among many: each that was placed is paid for."""

    @pytest.fixture(scope="class")
    @staticmethod
    def braked() -> Selection:
        return selector(braked_records(), ["brake_drag", COULOMB, "actuator_lag"]).run()

    def test_an_event_is_chosen(self, braked: Selection) -> None:
        assert braked.chosen == {"brake_drag"}
        assert braked.result.value("brake_drag", "brake_nm") == pytest.approx(BRAKE_NM, rel=0.03)

    def test_intervals_of_every_recording_that_has_one_were_chosen(self, braked: Selection) -> None:
        """Of 40 cells half of 40^2 intervals can be made."""
        assert MOST_CELLS == 40
        assert scan_choices("brake_drag", braked.result) == pytest.approx(2.0 * np.log(800.0))
        assert scan_choices(COULOMB, braked.result) == 0.0

    def test_it_begins_and_ends_inside_a_recording(self, braked: Selection) -> None:
        assert has_edge("brake_drag", braked.result)

    def test_a_brake_may_be_let_go_a_crack_does_not_heal(
        self, braked: Selection, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        assert healed_in("brake_drag", braked.result) == ""
        as_crack = replace(EFFECTS["brake_drag"], step=EFFECTS["stiffness_change"].step)
        monkeypatch.setattr("estimator.diagnosis.trial.EFFECTS", {"brake_drag": as_crack})
        assert healed_in("brake_drag", braked.result) == "run_1"

    def test_they_are_paid_for(self, braked: Selection) -> None:
        trial = braked.accepted["brake_drag"]
        plain, choices = gain(braked.retuned, trial.result), scan_choices("brake_drag", trial.result)
        assert choices >= scan_choices("brake_drag", braked.result)
        assert trial.gain.delta_bic == pytest.approx(plain.delta_bic - 2.0 * choices)
        assert trial.p_value == pytest.approx(min(1.0, plain.p_value * 3 * np.exp(choices)))


def test_what_lets_a_pressed_parameter_go_is_fitted_whatever_a_look_promises(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring in the line takes its damping below what it is trusted to; a look along its size shows nothing of it."""
    select = selector(quiet(values=ONE_MASS, samples=600), [COULOMB, "extra_torsional_mode"], floor=0.1)
    monkeypatch.setattr(Screen, "looks", lambda *_: [Look(Release((), ()), 0.0)])
    current = select.bench.fit(NOTHING)
    for pressed, looked_at in ((frozenset(), set()), (frozenset({"c"}), {"extra_torsional_mode"})):
        monkeypatch.setattr("estimator.diagnosis.selection.pressed_parameters", lambda _, found=pressed: found)
        assert set(select._looks(select.names, NOTHING, current)) == looked_at


class TestRules:
    """Single rules on fits of a given RMS and white errors."""

    def trial(self, name: str, rms: float, unknowns: int = 3) -> Trial:
        result = of_rms(rms, unknowns)
        return Trial(name, frozenset({name}), result, gain(self.RETUNED, result), None, 0.0, None)

    RETUNED = of_rms(1.0, 2)

    def test_chance_is_a_reason_to_fail(self, select: Selector) -> None:
        """A probability of 0.005 is 0.09 after 18 hypotheses."""
        result = of_rms(1.0, 3)
        strong = replace(gain(self.RETUNED, of_rms(0.9, 3)), delta_bic=20.0, p_value=0.005)
        p_value = strong.p_value * len(select.names)
        assert p_value > SIGNIFICANT
        failed = select._statistics_fail(COULOMB, result, strong, p_value)
        assert failed == "could be chance (p = 0.09 after 18 hypotheses)"

    @pytest.mark.parametrize(
        ("held", "holds"),
        [
            (HoldOut(1.0, 0.7), True),  # half of the power, three quarters of it where it was fitted
            (HoldOut(1.0, 0.95), False),  # a tenth
            (HoldOut(1.0, 0.95, spread=0.1), True),  # but unseen samples are too few to tell
            (HoldOut(0.101, 0.101), True),  # there was nothing to gain: the error was the noise already
            (HoldOut(0.101, 0.12), False),  # and it got worse
        ],
    )
    def test_a_gain_has_to_show_where_it_was_not_fitted(
        self, monkeypatch: pytest.MonkeyPatch, held: HoldOut, holds: bool
    ) -> None:
        monkeypatch.setattr(Selector, "_examine", lambda *_: held)
        select = selector(quiet(values=ONE_MASS, samples=600), floor=0.1)
        before, trial = of_rms(1.0, 2), self.trial(COULOMB, 0.5)
        assert select._holds_out(trial, before) is holds

    @pytest.mark.parametrize(("lag_rms", "named"), [(0.15, False), (0.3, True)])
    def test_nothing_is_named_in_place_of_what_is_too_small_to_tell(
        self, select: Selector, monkeypatch: pytest.MonkeyPatch, lag_rms: float, named: bool
    ) -> None:
        """A lag of no time at all that explains more than friction bars it; one that explains less does not."""
        lag = replace(self.trial("actuator_lag", lag_rms), failed="less than a tenth of the sampling period")
        values = {"actuator_lag": {"time_constant_s": 0.0}, COULOMB: {"friction_nm": 1.0}}
        monkeypatch.setattr(Trial, "values", property(lambda trial: values[trial.name]))
        monkeypatch.setattr(Selector, "_holds_out", lambda *_: True)
        monkeypatch.setattr(Selector, "_examined", lambda _, trial, __: trial)
        trials = {"actuator_lag": lag, COULOMB: self.trial(COULOMB, 0.2)}
        best = select._best(trials, self.RETUNED, self.RETUNED)
        assert (best is not None) is named

    @pytest.mark.parametrize(("lighter_rms", "named"), [(0.15, False), (0.1, True)])
    def test_what_was_too_light_to_count_is_no_evidence_for_another(
        self, select: Selector, monkeypatch: pytest.MonkeyPatch, lighter_rms: float, named: bool
    ) -> None:
        """A small rest that a second law of the shaft explains best is not told as friction that explains less."""
        monkeypatch.setattr(Selector, "_beyond_rest", lambda *_: True)
        monkeypatch.setattr(Selector, "_holds_out", lambda *_: True)
        monkeypatch.setattr(Selector, "_examined", lambda _, trial, __: trial)
        before = of_rms(0.2, 3)
        trials = {
            name: replace(self.trial(name, rms, 4), effects=frozenset({"backlash", name}))
            for name, rms in (("stiffness_nonlinearity", 0.1), (COULOMB, lighter_rms))
        }
        best = select._best(trials, before, self.RETUNED)
        assert (None if best is None else best.name) == (COULOMB if named else None)

    def test_the_special_case_is_taken_where_the_general_one_adds_little(self, select: Selector) -> None:
        special = self.trial(COULOMB, 0.2)
        for general_rms, taken in ((0.199, special.name), (0.1, STRIBECK)):
            general = self.trial(STRIBECK, general_rms, 5)
            assert select._simpler(general, {COULOMB: special, STRIBECK: general}, self.RETUNED).name == taken

    def test_a_special_case_that_failed_is_no_alternative(self, select: Selector) -> None:
        special = replace(self.trial(COULOMB, 0.2), failed="could be chance")
        general = self.trial(STRIBECK, 0.199, 5)
        assert select._simpler(general, {COULOMB: special, STRIBECK: general}, self.RETUNED) is general


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
