"""Laws without a name: found where there is one, none where there is none, and what is said of them."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.disturbances import Limits
from estimator.diagnosis.inference.hypotheses import NOTHING, Hypothesis
from estimator.diagnosis.table_curves import with_curve
from estimator.diagnosis.table_words import looks_like, shortest_formula
from estimator.diagnosis.tables import best_table, curve_through, widened_by_jackknife
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.simulate import simulate
from estimator.physics.tables import Table
from estimator.physics.unknowns import LOAD_TORQUE, Shared
from estimator.signals.record import FloatArray, Record
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

NOISE_RAD_S = 0.02
START = InitialCondition(5.0, 0.0, 2.0, 0.003, 2.0)
KNOTS = np.array([-0.08, -0.04, -0.02, -0.01, -0.005, 0.0, 0.005, 0.01, 0.02, 0.04, 0.08])


def recorded(effects: dict[str, dict[str, float]], seeds: tuple[int, ...] = (1, 2)) -> list[Record]:
    """Return recordings of a line with these effects, read with noise."""
    found = []
    for seed in seeds:
        torque = 5.0 + random_steps(1500, seed=seed, size_nm=60.0, hold=15)
        empty = record(torque, np.ones(1500), name=f"run_{seed}")
        out = simulate(grid_for(model(TWO_MASS), [empty]), empty, flat_values(TWO_MASS, effects), START)
        out += NOISE_RAD_S * np.random.default_rng(seed).standard_normal(out.size)
        found.append(record(torque, out, name=f"run_{seed}"))
    return found


def retuned(records: list[Record]) -> Hypothesis:
    """Return the line alone, fitted to recordings."""
    result = Bench(model(TWO_MASS, tolerance=0.1), records, [each.okay for each in records]).fit(NOTHING)
    nothing = np.zeros(0)
    return Hypothesis(NOTHING, result, nothing, Limits(nothing, nothing, nothing), 0.0, 0.0)


def test_a_gap_is_found_as_a_curve_over_the_twist_without_the_catalogue() -> None:
    """A gap of 0.02 rad, which the re-tuned line can't follow."""
    hypothesis = retuned(recorded({"backlash": {"gap_rad": 0.02, "contact_rad": 0.0005}}))
    found = best_table(hypothesis, model(TWO_MASS, tolerance=0.1))
    assert found is not None
    law = found.law
    assert law.place == "shaft_twist"
    assert law.not_carried == ()  # on each recording it is better by a fit to the other one
    assert law.rms_after < 0.5 * law.rms_before
    assert found.result.rms < 0.5 * hypothesis.result.rms
    assert law.reached == pytest.approx((law.knots[0], law.knots[-1]), rel=1e-3)  # no knot beyond what was simulated
    inside = np.abs(law.knots) < 0.008
    total = np.array(law.values) + law.slope * np.array(law.knots)
    assert np.max(np.abs(total[inside])) < 0.3 * TWO_MASS["k"] * 0.008


def test_a_clutch_that_slips_is_found_as_a_torque_that_yields() -> None:
    """A shaft of the same stiffness up to 45 Nm; the curve takes the line's own away."""
    knots = (-0.1, 0.0, 0.1)
    away = Table("shaft_twist", knots, tuple(-TWO_MASS["k"] * knot for knot in knots), None, TWO_MASS["c"]).effect()
    slider = {"friction_nm": 45.0, "yield_rad": 45.0 / TWO_MASS["k"], "sharpness": 10.0}
    clutch = {"table_shaft_twist": {key: each.value for key, each in away.items()}, "shaft_hysteresis": slider}
    hypothesis = retuned(recorded(clutch))
    found = best_table(hypothesis, model(TWO_MASS, tolerance=0.1))
    assert found is not None
    assert found.law.rms_after < 0.2 * found.law.rms_before
    assert found.effects["shaft_hysteresis"]["friction_nm"].value == pytest.approx(45.0, rel=0.05)
    assert found.law.looks_like.startswith("a clutch that slips at 4")
    reached, (first, *_, last) = found.law.reached, found.law.knots
    assert (first, last) == pytest.approx((min(reached[0], 0.0), max(reached[1], 0.0)))
    assert reached[1] - reached[0] > 0.2  # it slips further than a shaft of 45 Nm turns


def test_a_line_that_lacks_nothing_gets_no_law() -> None:
    assert best_table(retuned(recorded({})), model(TWO_MASS, tolerance=0.1)) is None


def test_the_free_form_of_a_place_fits_all_samples() -> None:
    hypothesis = retuned(recorded({"quadratic_friction": {"quadratic_nm_s2": 0.4}}))
    free = curve_through(hypothesis.result.first_outputs(), "motor_speed")
    assert free is not None
    assert free.chosen_by < 0.5 * hypothesis.result.rms
    assert curve_through(hypothesis.result.first_outputs(), "load_angle") is None


def test_a_curve_leaves_the_line_what_the_line_could_carry() -> None:
    """A slope over the speed is viscous friction too, a level a constant load: recordings tell their sums alone."""
    hypothesis = retuned(recorded({"quadratic_friction": {"quadratic_nm_s2": 0.4}}))
    without = hypothesis.result.first_outputs()
    free = curve_through(without, "motor_speed")
    assert free is not None
    assert free.descent.curve.values(free.z[free.descent.first : free.descent.after]).all()  # a level of its own
    found = with_curve(free)
    assert found.values_of("")["b_M"] == without.values_of("")["b_M"]
    assert found.values_of("")["J_M"] != without.values_of("")["J_M"]
    loads = [[each.local_of(i)[LOAD_TORQUE] for i in range(2)] for each in (without, found)]
    assert loads[0][0] == loads[1][0]
    assert loads[0][1] != loads[1][1]  # how much more the second recording has is seen
    slack = curve_through(
        retuned(recorded({"backlash": {"gap_rad": 0.02, "contact_rad": 0.0005}})).result, "shaft_twist"
    )
    assert slack is not None
    anchor = slack.descent.curve.zero
    assert slack.descent.curve.values(slack.z[slack.descent.first : slack.descent.after])[anchor] == 0.0


def test_a_curve_is_fitted_next_to_a_limit_that_is_infinite() -> None:
    """A set of the catalogue holds at infinity what it does not need."""
    hypothesis = retuned(recorded({"quadratic_friction": {"quadratic_nm_s2": 0.4}}))
    problem, x = hypothesis.result.problem, hypothesis.result.x
    unlimited = Shared("torque_saturation", "limit_sum_nm", 1.0, np.inf, np.inf, np.inf)
    first = len(problem.shared)
    result = replace(
        hypothesis.result, problem=replace(problem, shared=(*problem.shared, unlimited)), x=np.insert(x, first, np.inf)
    )
    free = curve_through(result.first_outputs(), "motor_speed")
    assert free is not None
    assert free.chosen_by < 0.5 * hypothesis.result.rms


def test_intervals_hold_what_the_curve_is_without_one_recording_each() -> None:
    """Of 10, 12 and 14 Nm the squared error by the jackknife is 2/3 of 8 Nm^2 (Efron and Tibshirani, 1993, ch. 11)."""
    table = Table("torque", (0.0, 1.0), (0.0, 12.0), ((0.0, 0.0), (11.0, 13.0)))
    wider = widened_by_jackknife(table, [np.array([0.0, torque]) for torque in (10.0, 12.0, 14.0)])
    assert wider.ci95 is not None
    np.testing.assert_allclose(wider.ci95[1], (12.0 - 1.96 * np.sqrt(16.0 / 3.0), 12.0 + 1.96 * np.sqrt(16.0 / 3.0)))
    assert widened_by_jackknife(table, [np.array([0.0, 12.0])] * 3) == table


def total_of(total: FloatArray, place: str = "shaft_twist", slope: float = 4000.0) -> Table:
    values = total - slope * KNOTS
    bands = tuple((float(v) - 2.0, float(v) + 2.0) for v in values)
    return Table(place, tuple(KNOTS.tolist()), tuple(values.tolist()), bands)


@pytest.mark.parametrize(
    ("total", "expected"),
    [
        (4000.0 * np.sign(KNOTS) * np.maximum(np.abs(KNOTS) - 0.008, 0.0), "a dead band of 0.016 rad"),
        (4000.0 * np.maximum(KNOTS, 0.0), "a spring that acts one way only"),
        (np.clip(4000.0 * KNOTS, -64.0, 64.0), "a limit of 64 Nm"),
        (4000.0 * KNOTS + 4e5 * KNOTS**2, ""),
        (0.0 * KNOTS, "no torque at all"),
    ],
)
def test_what_a_curve_looks_like(total: FloatArray, expected: str) -> None:
    assert looks_like(total_of(total), 4000.0) == expected


def test_the_shortest_formula_within_the_band() -> None:
    assert shortest_formula(total_of(3000.0 * KNOTS), 4000.0) == "torque = 3e+03 x"
    assert shortest_formula(total_of(300.0 * np.sign(KNOTS)), 4000.0) == "torque = 300 sign(x)"
    two = shortest_formula(total_of(3000.0 * KNOTS - 200.0 * np.sign(KNOTS)), 4000.0)
    assert two == "torque = 3e+03 x - 200 sign(x)"
    assert shortest_formula(total_of(0.0 * KNOTS), 4000.0) == "torque = 0 x"
    rough = total_of(300.0 * np.sin(200.0 * KNOTS))
    assert shortest_formula(rough, 4000.0) == ""
