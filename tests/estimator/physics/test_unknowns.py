"""What a fit may change: bounds and scales of the shared unknowns, and what every recording has of its own."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Held, Within
from estimator.physics.effects.periodic import ORDERS
from estimator.physics.fit import fit
from estimator.physics.free_run import free_run
from estimator.physics.layout import flat, grid_for, slot
from estimator.physics.model import Parameter
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import effect_unknowns, local_basis, nominal_unknowns, own_of_each, released
from estimator.signals.record import OutputKind
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, record

CRUISE = InitialCondition(40.0, 2.0, 30.0, 40.0 / TWO_MASS["k"], 30.0)


def test_nominal_unknowns_stay_within_their_tolerance() -> None:
    unknowns = {s.name: s for s in nominal_unknowns(model(TWO_MASS, tolerance=0.3))}
    assert list(unknowns) == list(TWO_MASS)
    for name, shared in unknowns.items():
        assert shared.scale * shared.low == pytest.approx(0.7 * TWO_MASS[name])
        assert shared.scale * shared.high == pytest.approx(1.3 * TWO_MASS[name])
        assert shared.scale * shared.start == TWO_MASS[name]
        assert shared.slot == slot("", name)


@pytest.mark.parametrize(
    ("name", "given", "low", "high"),
    [
        ("J_L", Parameter(99.0, ci95=(62.0, 136.0)), 62.0, 136.0),  # measured: the interval
        ("b_M", Parameter(0.0, ci95=(0.0, 3.1)), 0.0, 31.0),  # nothing known: none, or ten times what is possible
        ("b_M", Parameter(0.4, ci95=(-0.2, 1.0)), 0.0, 10.0),
        ("c", Parameter(8.0, ci95=(2.0, 14.0)), 0.0, 140.0),  # wider than its value
        ("k", Parameter(4000.0, ci95=(1000.0, 7000.0)), 100.0, 70000.0),  # never none
        ("k", Parameter(4000.0, ci95=(-1.0, 7000.0)), 400.0, 70000.0),
    ],
)
def test_a_measured_parameter_is_fitted_within_its_interval_and_an_unknown_one_freely(
    name: str, given: Parameter, low: float, high: float
) -> None:
    line = model(TWO_MASS)
    (shared,) = (
        each
        for each in nominal_unknowns(replace(line, parameters={**line.parameters, name: given}))
        if each.name == name
    )
    assert shared.scale * shared.low == pytest.approx(low)
    assert shared.scale * shared.high == pytest.approx(high)
    assert shared.scale * shared.start == pytest.approx(given.value)


def test_friction_that_was_measured_as_none_is_found_from_there() -> None:
    line = model(TWO_MASS)
    rec = linear_record(TWO_MASS, random_steps(2000, seed=1), CRUISE)
    unsure = replace(line, parameters={**line.parameters, "b_M": Parameter(0.0, ci95=(0.0, 3.1))})
    found = fit(make_problem(unsure, [rec], nominal_unknowns(unsure)))
    assert found.value("", "b_M") == pytest.approx(TWO_MASS["b_M"], rel=0.02)


@pytest.mark.parametrize(
    ("half_width", "expected"), [(0.1, (1.6, 2.4)), (1.0, (1.0, 3.0)), (5.0, (0.0, 7.0)), (np.inf, (0.0, 22.0))]
)
def test_a_measured_value_is_trusted_to_its_interval_and_to_no_less_than_a_share(
    half_width: float, expected: tuple[float, float]
) -> None:
    assert Parameter.measured(2.0, half_width, 0.2).ci95 == pytest.approx(expected)


def test_an_effect_has_unknowns_once_per_start() -> None:
    rec = linear_record(TWO_MASS, random_steps(500, seed=1), CRUISE)
    ladder = effect_unknowns("backlash", model(TWO_MASS), [rec])
    assert len(ladder) == 4
    assert len({release.shared[0].start for release in ladder}) == 4
    for release in ladder:
        shared = release.shared
        assert release.own == ((),)
        assert [(s.effect, s.name) for s in shared] == [
            ("backlash", name) for name in ("gap_rad", "contact_rad", "pull", "across")
        ]
        assert shared[0].scale == pytest.approx(0.2 * 100.0 / TWO_MASS["k"])


def test_a_start_may_hold_a_value_or_have_bounds_of_its_own() -> None:
    rec = linear_record(TWO_MASS, random_steps(500, seed=1), CRUISE)
    (release,) = released("backlash", model(TWO_MASS), [rec], [(Within(1.0, 0.5, 2.0), Held(0.3), 0.4, Held(1.0))])
    usual = effect_unknowns("backlash", model(TWO_MASS), [rec])[0].shared
    gap, contact, pull, across = release.shared
    assert (gap.low, gap.start, gap.high, gap.scale) == (0.5, 1.0, 2.0, usual[0].scale)
    assert contact.low == contact.start == contact.high == 0.3
    assert pull == replace(usual[2], start=0.4)
    assert across.low == across.start == across.high == 1.0


def test_moments_and_phases_are_every_recordings_own() -> None:
    line = model(TWO_MASS)
    first = linear_record(TWO_MASS, random_steps(500, seed=1), CRUISE)
    second = replace(linear_record(TWO_MASS, random_steps(300, seed=2), CRUISE), began_s=-7.0)
    (brake,) = effect_unknowns("brake_drag", line, [first, second])
    assert [s.name for s in brake.shared] == ["brake_nm", "presliding_rad", "creep_rad_s"]
    spans = [[(s.name, s.low, s.high) for s in own] for own in brake.own]
    assert spans[0] == [("from_s", 0.0, pytest.approx(5.0)), ("to_s", 0.0, pytest.approx(5.0))]
    assert spans[1] == [("from_s", 7.0, pytest.approx(10.0)), ("to_s", 7.0, pytest.approx(10.0))]
    ripples = effect_unknowns("torque_ripple", line, [first, second])
    orders = [next(s for s in release.shared if s.name == "order") for release in ripples]
    assert {order.start for order in orders} == set(map(float, ORDERS))
    for order, release in zip(orders, ripples, strict=True):
        assert order.low == order.start == order.high
        assert [[s.name for s in own] for own in release.own] == [["phase_rad", "share_phase_rad"]] * 2


@pytest.mark.parametrize("name", ["torque_derating", "warming_friction"])
def test_what_continues_from_recording_to_recording_is_counted_from_the_first(name: str) -> None:
    """What the first one began with is part of the line's own values; a further output has that of its recording."""
    first, second = (linear_record(TWO_MASS, random_steps(300, seed=seed), CRUISE) for seed in (1, 2))
    first, second = replace(first, name="run_1"), replace(second, name="run_2")
    also_first = replace(first, lead=first)
    continued = replace(first, name="run_1#2", began_s=-8.0)
    found = own_of_each([name], [first, second, also_first, continued])
    bounds = [[(each.name, each.low, each.start, each.high) for each in own] for own in found]
    held = [("warm", 0.0, 0.0, 0.0)]
    assert bounds == [held, [("warm", 0.0, 0.0, 1.0)], held, held]


@pytest.mark.parametrize("kind", [OutputKind.SPEED, OutputKind.POSITION])
@pytest.mark.parametrize("values", [ONE_MASS, TWO_MASS])
def test_unknowns_and_start_are_one_to_one(values: dict[str, float], kind: OutputKind) -> None:
    rec = linear_record(values, random_steps(500, seed=2), CRUISE, kind=kind)
    basis = local_basis(model(values), rec, profile=False)
    two, position = "k" in values, kind is OutputKind.POSITION
    assert basis.guess.size == 2 + position + 2 * two
    seen = [basis.start(unit_x) for unit_x in np.eye(basis.guess.size)]
    moved = [(s.load_torque_nm, s.angle_rad, s.speed_rad_s, s.twist_rad, s.load_speed_rad_s) for s in seen]
    changed = [[i for i, value in enumerate(row) if value != 0.0] for row in moved]
    assert changed == [[0], [2], *([[1]] if position else []), *([[3], [4]] if two else [])]
    assert all(np.isfinite(basis.scale))
    assert all(basis.scale > 0)


def test_the_guess_is_read_off_a_steady_recording() -> None:
    """At constant speed the load torque is the mean torque less viscous friction, whatever the model's inertia."""
    torque = np.full(500, 0.0) + random_steps(500, seed=3, size_nm=1.0)
    load = -(TWO_MASS["b_M"] + TWO_MASS["b_L"]) * 30.0
    rec = linear_record(TWO_MASS, torque, InitialCondition(load, 0.0, 30.0, 0.0, 30.0))
    basis = local_basis(model(TWO_MASS), rec, profile=False)
    start = basis.start(basis.guess)
    assert start.speed_rad_s == pytest.approx(30.0, abs=0.1)
    assert start.load_speed_rad_s == pytest.approx(30.0, abs=0.1)
    assert start.load_torque_nm == pytest.approx(load, abs=0.5)


START = InitialCondition(25.0, 0.0, 8.0, 0.01, 7.5)


def test_with_the_true_model_only_the_noise_is_left() -> None:
    rec = linear_record(TWO_MASS, random_steps(1500, seed=1), START, sigma=0.05)
    clean = linear_record(TWO_MASS, random_steps(1500, seed=1), START)
    run = free_run(model(TWO_MASS), rec)
    assert run.rms == pytest.approx(0.05, rel=0.06)  # 1500 samples: 1.8 % standard error
    np.testing.assert_allclose(run.output, clean.output, atol=0.05)
    assert run.start.load_torque_nm == pytest.approx(25.0, abs=1.0)
    assert run.start.speed_rad_s == pytest.approx(8.0, abs=0.1)


def test_an_effect_of_the_model_acts() -> None:
    torque = random_steps(800, seed=4)
    late = np.concatenate([np.full(3, torque[0]), torque[:-3]])
    rec = replace(linear_record(ONE_MASS, late, START, sigma=0.05), torque_nm=torque[:, None])
    delayed = model(ONE_MASS, effects={"transport_delay": {"delay_s": 0.03}})
    assert free_run(delayed, rec).rms == pytest.approx(0.05, rel=0.1)
    assert free_run(model(ONE_MASS), rec).rms > 0.1


def test_masked_samples_are_simulated_but_not_judged() -> None:
    rec = linear_record(ONE_MASS, random_steps(800, seed=5), START, sigma=0.05)
    okay = np.arange(800) % 7 != 0
    holed = replace(rec, okay=okay, output=np.where(okay, rec.output, np.nan))
    run = free_run(model(ONE_MASS), holed)
    assert run.rms == pytest.approx(0.05, rel=0.1)
    assert np.isfinite(run.output).all()


@pytest.mark.parametrize(("seed", "twist_rad", "speed_rad_s"), [(8, 0.06, 0.0), (10, -0.06, 0.0), (5, -0.06, 0.5)])
def test_a_recording_may_begin_on_either_flank_of_a_gap(seed: int, twist_rad: float, speed_rad_s: float) -> None:
    """The mean load tells the flank of the average, not that of the first sample: from there the fit gets stuck."""
    geared = model(TWO_MASS, effects={"backlash": {"gap_rad": 0.1, "contact_rad": 1e-3}})
    torque = random_steps(400, seed, size_nm=60.0, hold=40)
    blank = record(torque, np.ones(400))
    start = InitialCondition(0.0, 0.0, speed_rad_s, twist_rad, speed_rad_s)
    clean = simulate(grid_for(geared, [blank]), blank, flat(geared), start)
    noise = 0.02 * np.random.default_rng(9).standard_normal(400)
    rec = record(torque, clean + noise)
    assert fit(make_problem(geared, [rec], ())).rms > 0.05
    assert free_run(geared, rec).rms == pytest.approx(0.02, rel=0.1)
