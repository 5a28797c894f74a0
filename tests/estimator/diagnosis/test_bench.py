"""A bench: each hypothesis is fitted once, and what a fit missed is found from where another ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import bench as bench_module
from estimator.diagnosis.bench import Bench
from estimator.diagnosis.hypotheses import NOTHING, Effects, effects_of, everything
from estimator.diagnosis.screening import Screen
from estimator.physics.fit import FitResult
from estimator.physics.starts import begun, close
from estimator.physics.unknowns import Release, effect_unknowns
from tests.estimator.diagnosis.one_effect import SHAKES, bench_with
from tests.estimator.diagnosis.planted import SIGMA, quiet, rubbing
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, model
from tests.estimator.physics.cracking import AT_S, CRACK, LAST_S, SOUND, cracking, the_other_way_round

COULOMB = frozenset({"coulomb_friction_motor"})
FRICTION_NM = 12.0


@pytest.fixture(scope="module")
def bench() -> Bench:
    records = rubbing(lambda speed: FRICTION_NM)
    return Bench(model(ONE_MASS), records, everything(records))


def test_each_set_is_fitted_once(bench: Bench) -> None:
    first = bench.fit(NOTHING)
    assert bench.fit(NOTHING) is first
    assert bench.fit(COULOMB, first) is bench.fit(COULOMB)


def test_the_planted_effect_is_fitted_to_the_noise(bench: Bench) -> None:
    nominal, released = bench.fit(NOTHING), bench.fit(COULOMB, bench.fit(NOTHING))
    assert nominal.rms > 2.0 * SIGMA
    assert released.rms == pytest.approx(SIGMA, rel=0.1)
    assert released.value("coulomb_friction_motor", "friction_nm") == pytest.approx(FRICTION_NM, rel=0.05)


def names_of(result: FitResult) -> list[tuple[str, str]]:
    return [(shared.effect, shared.name) for shared in result.problem.shared]


def test_nominal_parameters_come_first_then_effects_as_they_were_added(bench: Bench) -> None:
    late = bench.fit(frozenset({"transport_delay"}), bench.fit(NOTHING))
    both = bench.fit(frozenset({"transport_delay", "actuator_lag"}), late)
    assert names_of(both) == [
        ("", "J_M"),
        ("", "b_M"),
        ("transport_delay", "delay_s"),
        ("actuator_lag", "time_constant_s"),
        ("actuator_lag", "shape"),
    ]
    for basis in both.problem.local:
        assert [(unknown.effect, unknown.name) for unknown in basis.own] == [
            ("transport_delay", "before_nm"),
            ("actuator_lag", "before_nm"),
        ]


def test_an_effect_that_is_taken_out_takes_its_own_unknowns_along(bench: Bench) -> None:
    lagging = bench.fit(frozenset({"actuator_lag"}), bench.fit(NOTHING))
    without = bench.fit(COULOMB, lagging)
    assert effects_of(lagging) == {"actuator_lag"}
    assert effects_of(without) == COULOMB
    assert [basis.own for basis in without.problem.local] == [(), ()]


def test_effects_that_nothing_starts_from_are_refused() -> None:
    records = quiet(seeds=(1,), values=ONE_MASS, samples=300)
    with pytest.raises(ValueError, match="fitted from a fit without them, came none"):
        Bench(model(ONE_MASS), records, everything(records)).fit(COULOMB)


def test_a_step_that_a_larger_fit_brought_is_told_from_its_moment_on_too() -> None:
    """Else what it can not explain the other way round is left to another effect."""
    records = [cracking(1, AT_S, LAST_S), cracking(2, 0.0, LAST_S)]
    the_wrong_way = the_other_way_round(SOUND, records, [(0.0, AT_S), (0.0, 0.0)])
    crack = Bench(SOUND, records, everything(records))
    told = crack.fit_less(frozenset({CRACK}), the_wrong_way)
    assert the_wrong_way.value(CRACK, "change") > 0.0 > told.value(CRACK, "change")
    assert told.value("", "k") == pytest.approx(TWO_MASS["k"], rel=0.01)


STRIBECK: Effects = frozenset({"stribeck_friction"})


def far_from_the_start() -> tuple[Bench, Release]:
    """A bench with Stribeck friction, and a start twenty times too small: a few steps do not get there."""
    records = rubbing(lambda speed: float(8.0 + 14.0 * np.exp(-((speed / 0.8) ** 2))))
    fresh = Bench(model(ONE_MASS), records, everything(records))
    start = effect_unknowns("stribeck_friction", fresh.model, records)[0]
    return fresh, replace(start, shared=tuple(replace(unknown, start=0.05 * unknown.start) for unknown in start.shared))


def test_a_rough_fit_is_gone_on_with() -> None:
    fresh, small = far_from_the_start()
    nominal = fresh.fit(NOTHING)
    rough = fresh.rough_fit(STRIBECK, nominal, [small])
    assert fresh.rough_fit(STRIBECK, nominal, [small]) is rough
    assert not rough.converged
    finished = fresh.fit(STRIBECK)
    assert finished.converged
    assert finished.squares < rough.squares < nominal.squares


def test_a_rough_fit_that_stays_near_the_best_is_taken_further() -> None:
    fresh, small = far_from_the_start()
    rough = fresh.rough_fit(STRIBECK, fresh.fit(NOTHING), [small])
    further = fresh.go_on(STRIBECK)
    assert further.squares < rough.squares
    finished = fresh.fit(STRIBECK)
    assert finished.squares <= further.squares
    assert fresh.go_on(STRIBECK) is finished


def test_fits_but_one_let_their_derivatives_go() -> None:
    records = rubbing(lambda speed: FRICTION_NM)
    bench = Bench(model(ONE_MASS), records, everything(records))
    kept = bench.fit(COULOMB, bench.fit(NOTHING))
    bench.let_go(COULOMB)
    assert bench.fit(COULOMB) is kept
    assert kept.derivative is not None
    assert bench.fit(NOTHING).derivative is None


def test_a_derivative_that_takes_much_room_is_found_again_when_it_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    records = rubbing(lambda speed: FRICTION_NM)
    bench = Bench(model(ONE_MASS), records, everything(records))
    plenty = bench.fit(NOTHING)
    monkeypatch.setattr(bench_module, "MUCH_BYTES", 0)
    scarce = Bench(model(ONE_MASS), records, everything(records)).fit(NOTHING)
    assert scarce.derivative is None
    scale = np.abs(plenty.jacobian).max(axis=0)
    np.testing.assert_allclose(scarce.jacobian / scale, plenty.jacobian / scale, atol=0.01)  # a last small step away


class TestLocalMinima:
    """What a fit missed from where it began is found from where another ended."""

    MODE = frozenset({"extra_torsional_mode"})

    def with_mode(self, inertia: float, frequency_hz: float, line_share: float) -> Bench:
        """A line with one more spring in it, so soft that the shaft's stiffness ends at its tolerance of 20 %."""
        values = {
            "inertia_kg_m2": inertia,
            "frequency_hz": frequency_hz,
            "damping_ratio": 0.045,
            "line_share": line_share,
        }
        return bench_with("extra_torsional_mode", values, SHAKES)

    @pytest.mark.parametrize(("inertia", "frequency_hz", "line_share"), [(0.1, 11.0, 0.72), (0.1, 20.0, 0.76)])
    def test_the_rest_of_an_effect_shows_once_its_spring_is_fitted(
        self, inertia: float, frequency_hz: float, line_share: float
    ) -> None:
        bench = self.with_mode(inertia, frequency_hz, line_share)
        first = bench.fit(self.MODE, bench.fit(NOTHING))
        again = bench.fit_again(self.MODE, "extra_torsional_mode")
        assert first.rms > 3.0 * SIGMA
        assert again.rms == pytest.approx(SIGMA, rel=0.05)
        assert again is bench.fit(self.MODE)
        assert again.value("extra_torsional_mode", "frequency_hz") == pytest.approx(frequency_hz, rel=0.02)

    def test_the_rest_is_looked_for_once(self, monkeypatch: pytest.MonkeyPatch) -> None:
        bench = self.with_mode(0.1, 20.0, 0.76)
        bench.fit(self.MODE, bench.fit(NOTHING))
        again = bench.fit_again(self.MODE, "extra_torsional_mode")
        monkeypatch.setattr(bench_module, "begun", None)
        assert bench.fit_again(self.MODE, "extra_torsional_mode") is again

    def test_where_a_look_promises_next_to_nothing_nothing_is_fitted(self, monkeypatch: pytest.MonkeyPatch) -> None:
        bench = self.with_mode(0.2, 13.0, 0.76)
        first = bench.fit(self.MODE, bench.fit(NOTHING))
        monkeypatch.setattr(bench_module, "begun", None)
        assert bench.fit_again(self.MODE, "extra_torsional_mode") is first

    @pytest.mark.parametrize("hopeless", [0.0, bench_module.HOPELESS])
    def test_a_fit_begun_once_more_that_is_far_behind_is_not_gone_on_with(
        self, hopeless: float, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        bench = self.with_mode(0.1, 20.0, 0.76)
        first = bench.fit(self.MODE, bench.fit(NOTHING))
        monkeypatch.setattr(bench_module, "HOPELESS", hopeless)
        again = bench.fit_again(self.MODE, "extra_torsional_mode")
        assert (again is first) is (hopeless == 0.0)

    def test_a_better_fit_stays(self) -> None:
        bench = self.with_mode(0.2, 13.0, 0.76)
        first = bench.fit(self.MODE, bench.fit(NOTHING))
        assert first.rms == pytest.approx(SIGMA, rel=0.05)
        assert bench.fit_again(self.MODE, "extra_torsional_mode").squares <= first.squares

    def test_before_another_is_named_every_start_is_tried(self) -> None:
        bench = self.with_mode(0.2, 13.0, 0.76)
        right = bench.fit(self.MODE, bench.fit(NOTHING))
        bench._fits[self.MODE] = replace(right, residual=5.0 * right.residual)  # as if it had ended elsewhere
        assert bench.fit_widely(self.MODE, "extra_torsional_mode").squares == pytest.approx(right.squares, rel=1e-4)

    def test_no_start_is_tried_twice_but_one_that_stayed_close_behind_the_best(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        bench, name = self.with_mode(0.2, 13.0, 0.76), "extra_torsional_mode"
        before, tried = bench.fit(NOTHING), list[Sequence[Release]]()
        releases = [look.release for look in Screen(before, bench.model).looks(name)]
        bench.rough_fit(self.MODE, before, releases)
        known = bench.fit(self.MODE)

        def fitted(effects: Effects, warm: FitResult | None, releases: Sequence[Release]) -> FitResult:
            tried.append(releases)
            return known

        monkeypatch.setattr(bench, "_fit", fitted)
        assert bench.fit_widely(self.MODE, name) is known
        heat = begun(bench._problems(self.MODE, before, releases), before)
        assert tried == [[releases[i] for i in sorted(close(heat)[1:])]]

    def test_fewer_effects_start_from_where_more_ended_too(self) -> None:
        records = rubbing(lambda speed: FRICTION_NM)
        bench = Bench(model(ONE_MASS), records, everything(records))
        right = bench.fit(COULOMB, bench.fit(NOTHING))
        larger = bench.fit(COULOMB | {"actuator_lag"}, right)
        bench._fits[COULOMB] = replace(right, residual=5.0 * right.residual)  # as if it had ended elsewhere
        again = bench.fit_less(COULOMB, larger)
        assert again.squares == pytest.approx(right.squares, rel=1e-4)
        bench._fits[COULOMB] = worse = replace(right, residual=5.0 * right.residual)
        assert bench.fit_less(COULOMB, larger) is worse  # that fit has been begun from
        assert bench.fit_less(COULOMB, replace(larger, x=larger.x + 1e-6)) is not worse

    def test_what_fewer_effects_had_found_better_stays(self, bench: Bench) -> None:
        right = bench.fit(COULOMB, bench.fit(NOTHING))
        larger = bench.fit(COULOMB | {"actuator_lag"}, right)
        assert bench.fit_less(COULOMB, larger).squares <= right.squares
