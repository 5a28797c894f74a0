"""What the tests of the laws share: one recording's torque, and the comparison of kernel and reference."""

from collections.abc import Mapping

import numpy as np

from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import Grid, flat_values
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics import reference
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS, model, random_steps, record
from tests.estimator.physics.reference import Held, Rhs, TwoMass

SAMPLES = 250
SUBSTEPS = 20
"""Fine enough that what differs is the law and not the integration."""

SIGN_WIDTH = 0.05
TOLERANCE = 1e-4
"""Of the output's range: events and angles are reported to within a fraction of an integration step of 0.5 ms."""

START = InitialCondition(load_torque_nm=12.0, angle_rad=0.0, speed_rad_s=1.5, twist_rad=0.004, load_speed_rad_s=1.4)
TORQUE = random_steps(SAMPLES, seed=1, hold=10)
TIME_S = np.arange(SAMPLES) * SAMPLE_TIME_S

Effects = Mapping[str, Mapping[str, float]]


def measured(output: FloatArray | None = None, torque_nm: FloatArray = TORQUE) -> Record:
    """Wrap a torque in a recording; its output is what periodic laws take the angle from."""
    return record(torque_nm, np.ones(SAMPLES) if output is None else output)


def kernel_output(effects: Effects, rec: Record, values: Mapping[str, float] = TWO_MASS) -> FloatArray:
    """Simulate a recording in small steps."""
    grid = Grid(model(values).structure, SUBSTEPS, SIGN_WIDTH)
    return simulate(grid, rec, flat_values(values, effects), START)


def start_vector(start: InitialCondition = START) -> FloatArray:
    """Return the start as the reference's state."""
    return np.array([start.angle_rad, start.speed_rad_s, start.twist_rad, start.load_speed_rad_s])


def two_mass(**laws: object) -> TwoMass:
    """Write down the line with some laws replaced."""
    return TwoMass(TWO_MASS, START.load_torque_nm, **laws)  # type: ignore[arg-type]


def solved(rhs: Rhs, events_s: tuple[float, ...] = (), held: Held | None = None) -> FloatArray:
    """Solve the reference for the motor's speed at every sample."""
    torque = held or Held.of(TORQUE, SAMPLE_TIME_S)
    return reference.solve(rhs, start_vector(), torque, TIME_S, events_s)[:, reference.SPEED]


def assert_same(kernel: FloatArray, expected: FloatArray, without: FloatArray, tolerance: float = TOLERANCE) -> None:
    """Compare, and make sure that leaving the effect out would have been noticed."""
    size = float(np.ptp(expected))
    assert np.max(np.abs(without - expected)) > 50.0 * tolerance * size
    assert np.max(np.abs(kernel - expected)) < tolerance * size


def assert_law(effects: Effects, expected: FloatArray, rec: Record | None = None, tolerance: float = TOLERANCE) -> None:
    """Compare the kernel under some effects with the reference."""
    rec = measured() if rec is None else rec
    assert_same(kernel_output(effects, rec), expected, kernel_output({}, rec), tolerance)
