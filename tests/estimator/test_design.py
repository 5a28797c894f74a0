"""An experiment on paper tells hypotheses apart by as much as a fit of what it then gives does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.design.left_open import left_open, with_one_more
from estimator.design.open import Candidate, Open, Untested, name_of, precision_of as precision
from estimator.design.paper import (
    LEAST_DIFFERENCE,
    Width,
    _on_paper as on_paper,
    as_model,
    distance,
    expected,
    shown,
    widths,
)
from estimator.design.untested import with_untested
from estimator.diagnosis.inference.decide import Judged
from estimator.diagnosis.inference.descent import THOROUGH, descended
from estimator.diagnosis.inference.disturbances import whitener_of
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import all_good_samples
from estimator.diagnosis.inference.search import search_from_nothing
from estimator.diagnosis.noise import noise_floor
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import not_fitted
from estimator.physics.layout import flat, grid_for
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.tables import Table
from estimator.physics.unknowns import own_unknowns
from estimator.signals.record import FloatArray, Record, separated_outputs
from tests.estimator.diagnosis.one_effect import SEEDS, Bench, bench_with
from tests.estimator.diagnosis.planted import SAMPLES, SIGMA, drive_torque
from tests.estimator.diagnosis.test_best_table import recorded
from tests.estimator.diagnosis.test_several_outputs import SHAFT_TORQUE, with_output
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

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


def test_what_pushed_the_vehicle_pushes_it_on_paper(known: Open) -> None:
    candidate = known.candidates[0]
    load = as_model(candidate, known.line).load
    assert isinstance(load, float)
    assert load == pytest.approx(5.0, abs=0.5)  # InitialCondition of the bench


def driven(known: Open, torque_nm: float, cycles: int = 400) -> Record:
    """Back and forth through standstill, as the first hypothesis lets the motor turn."""
    turns = np.where(np.arange(cycles) // 100 % 2 == 0, torque_nm, -torque_nm)
    return record(turns, simulated(known, turns), name="paper")


def simulated(known: Open, torque_nm: FloatArray) -> FloatArray:
    """The motor's speed under a torque, as what simulates best has it."""
    line = as_model(*known.foremost)
    silent = record(torque_nm, np.zeros(torque_nm.size), name="paper")
    return simulate(grid_for(line, [silent]), silent, flat(line), InitialCondition(0.0, 0.0, 0.0))


def with_share(of: Record, share: float) -> Record:
    """The same sum of torques, so much of it from the first inverter."""
    return replace(of, torque_nm=np.outer(of.total_torque_nm, [share, 1.0 - share]))


def supposed(known: Open, name: str) -> Untested:
    """An effect that was not tested, in the size at which a fit of it begins."""
    return with_untested(replace(known, untested=(name,))).supposed[name]


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
    said = replace(paper, output=on_paper(truth, known.line, [paper]).outputs[0])
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
    assert shown(halves, with_share(paper, 0.5)) == {}
    assert shown(halves, with_share(paper, 1.0)) == {GAIN: math.inf}


def test_what_an_experiment_hardly_tells_is_not_shown_by_it(known: Open) -> None:
    halves = recorded_with_share(replace(known, untested=(GAIN,)), 0.5)
    asked = replace(halves, supposed={GAIN: supposed(halves, GAIN)})
    short, long = (with_share(driven(known, 60.0, cycles), 1.0) for cycles in (8, 800))
    assert list(shown(asked, long)) == [GAIN]
    assert shown(asked, long)[GAIN] > LEAST_DIFFERENCE
    assert shown(asked, short) == {}


def test_a_gain_that_was_not_tested_moves_the_values_by_what_it_changes_the_torque(known: Open) -> None:
    found = supposed(recorded_with_share(known, 0.5), GAIN)
    assert found.size == {"gain_m1": pytest.approx(0.9)}
    moved = [share for name, share in found.moves.items() if name in ("J_M", "k")]
    assert moved
    assert all(share == pytest.approx(-0.05, abs=0.01) for share in moved)


def left_by(bench: Bench, *names: str) -> Open:
    """What recordings leave open that only one set of effects was searched in."""
    records = separated_outputs(bench.records, noise_floor)
    fits = Fits(bench.model, records, all_good_samples(records), names)
    best = search_from_nothing(fits).best
    return Open(fits.model, (Candidate(name_of(best.effects), 1.0, best, precision(best)),), {}, ())


def test_what_the_noise_conceals_is_untested_where_it_moves_a_value_and_an_experiment_shows_it() -> None:
    quiet = bench_with(NAMES[0], {"friction_nm": 8.0})
    noise = [30.0 * SIGMA * np.random.default_rng(seed).standard_normal(each.time_s.size)
             for seed, each in enumerate(quiet.records)]  # fmt: skip
    loud = [replace(each, output=each.output + noise[i]) for i, each in enumerate(quiet.records)]
    assert with_untested(left_by(quiet, NAMES[0])).untested == ()
    found = with_untested(left_by(replace(quiet, records=loud), NAMES[0]))
    law = "torque_nonlinearity"
    assert law in found.untested
    assert all(each.moves for each in found.supposed.values())
    assert law not in shown(found, driven(found, 60.0))
    assert law in shown(found, driven(found, 1000.0, 1600))


def test_a_gain_that_the_other_values_take_up_is_untested_however_large_it_is() -> None:
    """All that is fast is shared by both inverters, all that is slow comes from one: J_M and k are off by as much."""
    fast = [random_steps(SAMPLES, seed, 60.0) for seed in SEEDS]
    slow = [np.zeros(SAMPLES), drive_torque(SEEDS[1]) - random_steps(SAMPLES, SEEDS[1])]
    bench = bench_with(NAMES[0], {"friction_nm": 8.0}, [0.95 * f + s for f, s in zip(fast, slow, strict=True)])
    read = [
        replace(each, torque_nm=np.column_stack([0.5 * f, 0.5 * f + s]))
        for each, f, s in zip(bench.records, fast, slow, strict=True)
    ]
    found = with_untested(left_by(replace(bench, records=read), NAMES[0]))
    assert GAIN in found.untested
    assert found.supposed[GAIN].moves["J_M"] == pytest.approx(-0.05, abs=0.02)


def test_a_likely_effect_that_the_verdict_does_not_name_is_another_explanation() -> None:
    """The friction is there: a verdict of nothing leaves it open, and a verdict that names it leaves nothing open."""
    bench = bench_with(NAMES[0], {"friction_nm": 8.0})
    fits = Fits(bench.model, bench.records, bench.use, [NAMES[0], "transport_delay"])
    friction = search_from_nothing(fits).best
    nothing, named = fits.trials.of([fits.nothing(), friction])
    assert [each.effects for each in with_one_more(fits, Judged(nothing, named, nothing))] == [friction.effects]
    assert with_one_more(fits, Judged(nothing, named, named)) == []


def test_what_the_verdict_says_could_as_well_be_there_is_not_decided() -> None:
    """A lag simulates as well as the delay that is there: likelihoods alone differ, and one more drive decides."""
    bench = bench_with("transport_delay", {"delay_s": 0.004})
    left, diagnosis = left_open(bench.records, bench.model, "quick")
    (named,) = diagnosis.effects
    assert named.name == "transport_delay"
    assert "actuator_lag" in named.indistinguishable_from
    assert {(each.name, each.probability) for each in left.candidates} >= {
        ("transport_delay", 0.5),
        ("actuator_lag", 0.5),
    }
    assert not left.is_decided


FILTER = ("speed_filter", {"time_constant_s": 0.01, "shape": 0.0})


def test_a_law_without_a_name_is_measured_where_its_curve_is_least_known() -> None:
    """A torque over the twist that no effect has; its outer values are known worst; a strong drive reaches them."""
    knots = np.linspace(-0.04, 0.04, 13)
    table = Table("shaft_twist", tuple(knots.tolist()), tuple((40.0 * np.sin(knots / 0.006)).tolist()))
    law = {table.name: {key: each.value for key, each in table.effect().items()}}
    left, _ = left_open(recorded(law), model(TWO_MASS, tolerance=0.1), "quick")
    assert left.unnamed is not None
    assert left.foremost == (left.unnamed.fit, left.unnamed.line)
    assert left.named is None

    def curve(size_nm: float) -> list[Width]:
        steps = random_steps(1500, seed=7, size_nm=size_nm, hold=15)
        on_paper = record(steps, simulated(left, steps), name="paper")
        return [each for each in widths(*left.foremost, on_paper) if each.name.startswith(table.name)]

    weak, strong = curve(2.0), curve(60.0)
    assert len(weak) == left.unnamed.line.effects[table.name]["knots"].value - 1.0  # one is held: a constant load
    assert all(each.after <= each.now for each in (*weak, *strong))
    least_known = max(range(len(weak)), key=lambda i: weak[i].now)
    assert strong[least_known].after < weak[least_known].after < weak[least_known].now


@pytest.mark.parametrize("bench", [bench_with(*FILTER), with_output(SHAFT_TORQUE, *FILTER)], ids=["one", "two outputs"])
def test_a_second_output_of_the_rig_is_on_paper_too(bench: Bench) -> None:
    """A lag of the torque and a filter of the speed move the speed alike; the shaft's torque knows only the lag."""
    filtered, lag = left_by(bench, FILTER[0]), left_by(bench, "actuator_lag")
    (truth,), (rival,) = filtered.candidates, lag.candidates
    differs = distance(truth, rival, filtered.line, driven(filtered, 60.0))
    assert (differs > LEAST_DIFFERENCE) is (truth.fit.outputs == 2)


def test_decided_is_the_verdict_that_the_odds_do_not_contradict(known: Open) -> None:
    one, other = (replace(each, probability=p) for each, p in zip(known.candidates, (0.96, 0.04), strict=True))
    agreed = replace(known, candidates=(one, other), named=one.effects)
    assert agreed.is_decided
    assert not replace(agreed, named=frozenset()).is_decided  # the verdict names nothing
    assert replace(agreed, named=frozenset(), traces=one.effects).is_decided  # what is left out is a trace
    assert not replace(agreed, named=None).is_decided  # something has no name
    assert [each.name for each in replace(known, named=one.effects).against] == [other.name]
