"""What a round fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.hypotheses import NOTHING, Effects
from estimator.diagnosis.screening import Look, Screen
from estimator.diagnosis.selection.rounds import WORTH_FINISHING, WORTH_GOING_ON
from estimator.physics.fit import FitResult
from estimator.physics.start import Start
from estimator.physics.unknowns import Release
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, quiet, rubbing, rubbing_speed
from tests.estimator.diagnosis.selection.mass import COULOMB, STRIBECK, rounds
from tests.estimator.physics.bench import ONE_MASS, record

LAG = 0.7
"""Part of a first-order lag's output that is left after a sample."""


def test_what_lets_a_pressed_parameter_go_is_fitted_whatever_a_look_promises(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring in the line takes its damping below what it is trusted to; a look along its size shows nothing of it."""
    tried = rounds(quiet(values=ONE_MASS, samples=600), [COULOMB, "extra_torsional_mode"])
    monkeypatch.setattr(Screen, "looks", lambda *_: [Look(Release((), ()), 0.0)])
    current = tried.jury.bench.fit(NOTHING)
    for pressed, looked_at in ((frozenset(), set()), (frozenset({"c"}), {"extra_torsional_mode"})):
        monkeypatch.setattr("estimator.diagnosis.selection.rounds.pressed_parameters", lambda _, found=pressed: found)
        assert set(tried._looks(tried.jury.names, NOTHING, current)) == looked_at


def test_a_fit_is_looked_around_once(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = rounds(quiet(values=ONE_MASS, samples=600), [COULOMB, STRIBECK])
    asked: list[str] = []
    looks = Screen.looks

    def counted(screen: Screen, name: str) -> list[Look]:
        asked.append(name)
        return looks(screen, name)

    monkeypatch.setattr(Screen, "looks", counted)
    current = tried.jury.bench.fit(NOTHING)
    first = tried._around(current, [COULOMB])
    both = tried._around(replace(current), [COULOMB, STRIBECK])
    assert asked == [COULOMB, STRIBECK]
    assert both[COULOMB] is first[COULOMB]
    tried._around(replace(current, x=current.x + 0.001), [COULOMB])
    assert asked == [COULOMB, STRIBECK, COULOMB]


def test_only_what_stays_near_the_best_is_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction that falls with speed: after a few more steps its dry part alone is left behind."""
    records = rubbing(lambda speed: float(2.0 + 30.0 * np.exp(-((speed / 2.0) ** 2))))
    tried = rounds(records, [COULOMB, STRIBECK])
    bench, ended = tried.jury.bench, {"rough_fit": {}, "go_on": {}}
    current = bench.fit(NOTHING)
    for step, found in ended.items():
        _spy(monkeypatch, step, found)
    trials = tried.try_all(NOTHING, current)
    gains = [{name: current.squares - r.squares for name, r in found.items()} for found in ended.values()]
    rough, further = gains
    assert set(further) == {name for name in rough if rough[name] >= WORTH_GOING_ON * max(rough.values())}
    finished = {name for name in further if further[name] >= WORTH_FINISHING * max(further.values())}
    assert STRIBECK in finished
    assert {name for name in trials if frozenset({name}) in bench._fits} == finished < set(further)


def test_a_fit_that_is_behind_the_one_it_extends_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """It holds that one as a special case: a tyre that slips was given up before it had come so far."""
    tried = rounds(rubbing(lambda speed: 30.0 * np.sign(speed)), [COULOMB, "quadratic_friction", "road_grade"])
    bench, further = tried.jury.bench, {}
    current = bench.fit(NOTHING)
    real = Bench.rough_fit

    def begun(bench: Bench, effects: Effects, *given: object) -> FitResult:
        left = {COULOMB: 0.5, "quadratic_friction": 1.02, "road_grade": 0.99}[next(iter(effects))]
        return replace(real(bench, effects, *given), residual=left * current.residual)

    monkeypatch.setattr(Bench, "rough_fit", begun)
    _spy(monkeypatch, "go_on", further)
    tried.try_all(NOTHING, current)
    assert set(further) == {COULOMB, "quadratic_friction"}


def test_a_law_is_not_left_behind_for_what_bends(monkeypatch: pytest.MonkeyPatch) -> None:
    """A grade takes up what is slow in two steps; dry friction, the best law, goes on however little of that it has."""
    records = rubbing(lambda speed: 30.0 * np.sign(speed))
    tried = rounds(records, [COULOMB, "quadratic_friction", "road_grade"])
    bench, further = tried.jury.bench, {}
    current = bench.fit(NOTHING)
    real = Bench.rough_fit

    def quick_grade(bench: Bench, effects: Effects, *given: object) -> FitResult:
        result = real(bench, effects, *given)
        left = {"road_grade": 0.1, COULOMB: 0.9, "quadratic_friction": 0.99}[next(iter(effects))]
        return replace(result, residual=left * current.residual)

    monkeypatch.setattr(Bench, "rough_fit", quick_grade)
    _spy(monkeypatch, "go_on", further)
    tried.try_all(NOTHING, current)
    assert set(further) == {"road_grade", COULOMB}


@pytest.mark.parametrize(("left", "finished"), [(0.7, True), (0.9, False)])
def test_what_lets_a_pressed_parameter_go_is_finished_unless_the_best_leaves_next_to_nothing(
    monkeypatch: pytest.MonkeyPatch, left: float, finished: bool
) -> None:
    """It shows itself late; but beside what leaves a fifth of the error it would have to show very late."""
    tried = rounds(rubbing(lambda speed: 30.0 * np.sign(speed)), [COULOMB, "extra_torsional_mode"])
    current, again, real = tried.jury.bench.fit(NOTHING), [], Bench.rough_fit
    begun: dict[Effects, FitResult] = {}

    def rough_fit(bench: Bench, effects: Effects, *given: object) -> FitResult:
        part = {COULOMB: 0.2, "extra_torsional_mode": left}[next(iter(effects))]
        begun[effects] = replace(real(bench, effects, *given), residual=part * current.residual)
        return begun[effects]

    def looked_again(bench: Bench, effects: Effects, name: str) -> FitResult:
        again.append(name)
        return bench.fit(effects)

    monkeypatch.setattr("estimator.diagnosis.selection.rounds.pressed_parameters", lambda _: frozenset({"c"}))
    monkeypatch.setattr(Bench, "rough_fit", rough_fit)
    monkeypatch.setattr(Bench, "go_on", lambda _, effects: begun[effects])
    monkeypatch.setattr(Bench, "fit_again", looked_again)
    monkeypatch.setattr(Bench, "fit_retold", lambda bench, effects, _: bench.fit(effects))
    tried.try_all(NOTHING, current)
    assert again == (["extra_torsional_mode"] if finished else [])


def test_no_other_way_begins_far_behind_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = rounds(rubbing(lambda speed: 30.0 * np.sign(speed)), [COULOMB, "quadratic_friction", "road_grade"])
    bench = tried.jury.bench
    current = bench.fit(NOTHING)
    left = {"road_grade": 0.4, COULOMB: 0.59, "quadratic_friction": 0.61}

    def fit(effects: Effects, warm: FitResult | None = None) -> FitResult:
        return replace(current, residual=left[next(iter(effects))] * current.residual)

    tried.trials = {name: tried.jury.trial(name, frozenset({name}), current, fit(frozenset({name}))) for name in left}
    monkeypatch.setattr(bench, "fit", fit)
    monkeypatch.setattr(bench, "fit_retold", lambda effects, name: fit(effects))
    firsts = tried.finished_first(current, NOTHING, 3)
    assert [first.name for first in firsts] == ["road_grade", COULOMB]


def test_a_look_alike_of_the_best_is_tried_in_its_place() -> None:
    """A lag whose fit beside friction has ended elsewhere, and a delay that stands near the place of the lag."""
    records = []
    for seed in (1, 2):
        torque = drive_torque(seed, 1200)
        lagged = lfilter([1.0 - LAG], [1.0, -LAG], torque)
        speed = rubbing_speed(lambda w: 12.0, lagged, Start(5.0, 0.0, 2.0))
        noise = SIGMA * np.random.default_rng(seed).standard_normal(torque.size)
        records.append(record(torque, speed + noise, name=f"run_{seed}"))
    tried, chosen = rounds(records, ["actuator_lag", "transport_delay"]), frozenset({COULOMB})
    bench = tried.jury.bench
    current = bench.fit(chosen, bench.fit(NOTHING))
    trials = tried.try_all(chosen, current)
    lag, delay = trials["actuator_lag"], trials["transport_delay"]
    assert lag.result.squares < delay.result.squares
    elsewhere = replace(lag.result, residual=3.0 * delay.result.residual)
    bench._fits[lag.effects] = elsewhere
    poor = tried.jury.trial("actuator_lag", lag.effects, current, elsewhere)
    again = tried._in_place_of_the_best({"actuator_lag": poor, "transport_delay": delay}, chosen, current)
    assert again["actuator_lag"].result.squares == pytest.approx(lag.result.squares, rel=1e-3)
    assert bench.fit(lag.effects) is again["actuator_lag"].result
    assert tried._in_place_of_the_best({COULOMB: poor}, NOTHING, current) == {}


def _spy(monkeypatch: pytest.MonkeyPatch, step: str, found: dict[str, FitResult]) -> None:
    real = getattr(Bench, step)

    def noted(bench: Bench, effects: Effects, *given: object) -> FitResult:
        (name,) = effects
        found[name] = real(bench, effects, *given)
        return found[name]

    monkeypatch.setattr(Bench, step, noted)
