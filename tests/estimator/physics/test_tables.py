"""Laws without a name: curves through knots, against laws that have one, and side by side."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from estimator.errors import BadModel
from estimator.physics.curve import curve, curve_over
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.free_run import free_run
from estimator.physics.layout import Grid, flat, flat_values, slot
from estimator.physics.model import DrivelineModel, Structure
from estimator.physics.simulate import simulate, simulate_each
from estimator.physics.tables import PLACES, Table
from estimator.signals.record import FloatArray
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, assert_same_to_rounding, model, random_steps, record

KNOTS, VALUES = (-3.0, -1.0, 0.0, 2.0, 5.0), (-4.0, -1.0, 0.0, 3.0, 3.5)
START = InitialCondition(12.0, 0.3, 5.0, 0.01, 4.0)
REC = record(random_steps(400, seed=7), np.ones(400))


def vector(*tables: Table, **line: float) -> FloatArray:
    effects = {table.name: {key: each.value for key, each in table.effect().items()} for table in tables}
    return flat_values({**TWO_MASS, **line}, effects)


def straight(place: str, slope: float, damping: float = 0.0) -> Table:
    knots = (-0.5, -0.1, 0.2, 0.5)
    return Table(place, knots, tuple(slope * knot for knot in knots), None, damping)


def run(p: FloatArray) -> FloatArray:
    return simulate(Grid(Structure.TWO_MASS, 20, 0.02), REC, p, START)


def test_between_knots_the_curve_is_that_of_fritsch_and_butland_and_beyond_them_straight() -> None:
    table = Table("motor_speed", KNOTS, VALUES)
    p, at = vector(table), slot(table.name, "knots")
    inside = np.linspace(-1.0, 2.0, 301)
    np.testing.assert_allclose(curve_over(inside, p, at), PchipInterpolator(KNOTS, VALUES)(inside), atol=1e-12)
    assert curve(-4.0, p, at, False) == pytest.approx((-5.5, 1.5))
    assert curve(8.0, p, at, False) == pytest.approx((4.0, 0.5 / 3.0))


def test_a_curve_of_zeros_is_no_law() -> None:
    zeros = [Table(place, (-1.0, 0.0, 1.0), (0.0, 0.0, 0.0)) for place in PLACES]
    np.testing.assert_allclose(run(vector(*zeros)), run(vector()), atol=1e-9)


@pytest.mark.parametrize(
    ("table", "line"),
    [
        (straight("motor_speed", 0.7), {"b_M": TWO_MASS["b_M"] + 0.7}),
        (straight("load_speed", 0.7), {"b_L": TWO_MASS["b_L"] + 0.7}),
        (straight("shaft_rate", 0.7), {"c": TWO_MASS["c"] + 0.7}),
        (straight("shaft_twist", 800.0), {"k": TWO_MASS["k"] + 800.0, "c": TWO_MASS["c"] * (1 + 800 / TWO_MASS["k"])}),
        (straight("shaft_twist", 0.0, damping=0.4), {"c": TWO_MASS["c"] + 0.4}),
    ],
    ids=lambda each: each.place if isinstance(each, Table) else "",
)
def test_a_straight_curve_is_more_of_what_the_line_has(table: Table, line: dict[str, float]) -> None:
    np.testing.assert_allclose(run(vector(table)), run(vector(**line)), atol=1e-6)


def test_a_curve_over_the_torque_acts_on_it() -> None:
    gain = {"inverter_gain_mismatch": {"gain_m1": 1.2, "gain_m2": 1.2}}
    expected = run(flat_values(TWO_MASS, gain))
    np.testing.assert_allclose(run(vector(straight("torque", 0.2))), expected, atol=1e-9)


def test_a_curve_over_the_angle_repeats_itself() -> None:
    """A curve of one period against one that holds it twice."""
    once, third = (0.0, 1.0, 2.0, 3.0), (0.0, 4.0, -4.0, 0.0)
    twice = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (0.0, 4.0, -4.0, 0.0, 4.0, -4.0, 0.0)
    found = run(vector(Table("load_angle", once, third)))
    np.testing.assert_allclose(found, run(vector(Table("load_angle", *twice))), atol=1e-9)
    assert np.max(np.abs(found - run(vector()))) > 0.01


@pytest.mark.parametrize("place", PLACES)
def test_side_by_side_is_one_by_one(place: str) -> None:
    """Values that differ by simulation, some of them 0, as a Jacobian moves them."""
    scale = 0.02 if place == "shaft_twist" else 2.0
    knots = tuple(scale * knot for knot in KNOTS)
    values = (0.0, -9.0, 4.0, 12.0, 0.0)
    p = vector(Table(place, knots, values))
    lines = []
    for i in range(11):
        lines.append(p.copy())
        lines[-1][slot(f"table_{place}", f"value_{1 + i % 5}")] += 0.1 * i
    grid, cases = Grid(Structure.TWO_MASS, 5, 0.02), [Case(line, START) for line in lines]
    together = simulate_each(grid, REC, cases)
    assert_same_to_rounding(together, np.array([simulate_each(grid, REC, [case])[0] for case in cases]))
    assert np.ptp(together, axis=0).max() > 0.0


def test_steep_curves_are_followed_in_smaller_steps() -> None:
    """A curve as steep as dry friction next to standstill, in steps that could not follow it."""
    steep = vector(Table("motor_speed", (-1.0, -0.01, 0.01, 1.0), (-30.0, -30.0, 30.0, 30.0)))
    coarse = simulate(Grid(Structure.TWO_MASS, 1, 0.02), REC, steep, START)
    fine = simulate(Grid(Structure.TWO_MASS, 400, 0.02), REC, steep, START)
    np.testing.assert_allclose(coarse, fine, atol=0.01 * float(np.ptp(fine)))


def test_one_mass_has_a_curve_over_its_speed() -> None:
    table = straight("motor_speed", 0.7)
    effects = {table.name: {key: each.value for key, each in table.effect().items()}}
    grid, start = Grid(Structure.ONE_MASS, 5, 0.02), InitialCondition(1.0, 0.0, 5.0)
    found = simulate(grid, REC, flat_values(ONE_MASS, effects), start)
    expected = simulate(grid, REC, flat_values({**ONE_MASS, "b_M": ONE_MASS["b_M"] + 0.7}, {}), start)
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_where_a_recording_begins_on_a_curve_over_the_angle_is_found() -> None:
    """A recording that begins a third of a turn further on: its own phase is estimated with its start."""
    table = Table("load_angle", (0.0, 2.0, 3.0, 6.0), (0.0, 25.0, -25.0, 0.0))
    line: DrivelineModel = model(TWO_MASS, effects={table.name: {k: v.value for k, v in table.effect().items()}})
    torque = 60.0 + random_steps(1500, seed=7)
    grid = Grid(Structure.TWO_MASS, 5, 0.02)
    p = flat(line)
    p[slot(table.name, "phase_rad")] = 2.1
    first = record(torque, np.ones(1500))
    for _ in range(40):  # the angle is read from the output
        first = record(torque, simulate(grid, first, p, START))
    assert free_run(line, first).rms < 0.02 * float(np.std(first.output))


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        (Table("shaft_twist", (0.0, 0.0, 1.0), (0.0, 1.0, 2.0)), "tables.shaft_twist.knots: .* larger than the one"),
        (Table("shaft_twist", (0.0,), (0.0,)), "tables.shaft_twist.knots: expected 2 to 16 knots, got 1"),
        (Table("torque", (0.0, 1.0), (0.0, np.nan)), "tables.torque.values: expected finite numbers"),
        (Table("load_angle", (0.0, 1.0, 2.0), (0.0, 1.0, 2.0)), "tables.load_angle.values: expected the last one like"),
        (Table("torque", (0.0, 1.0), (0.0, 1.0), damping=1.0), "tables.torque.damping: expected none but over"),
    ],
)
def test_what_is_no_curve_is_refused(table: Table, expected: str) -> None:
    with pytest.raises(BadModel, match=expected):
        model(TWO_MASS, effects={table.name: {key: each.value for key, each in table.effect().items()}})
