"""The compiled simulation against closed formulas and an exact linear solution written in the tests."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.kernel import state_vector
from estimator.physics.kernel.rates import met
from estimator.physics.laws import BEYOND, hyperbolic_tangent, power
from estimator.physics.layout import Grid, flat, grid_for
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Location, OutputKind
from tests.estimator.physics.bench import (
    ONE_MASS,
    SAMPLE_TIME_S,
    TWO_MASS,
    exact_states,
    linear_record,
    model,
    random_steps,
    record,
)

GAP, CONTACT = 0.02, 0.001

CROSSED = {
    "touches": (0.009, 0.0101, True),
    "parts": (-0.0101, -0.009, True),
    "crosses the gap": (0.0101, -0.0101, True),
    "turns within the gap": (0.003, -0.003, False),
    "stays in the gap": (0.003, 0.0099, False),
    "continues into its play": (0.0101, 0.0109, True),
    "rests in its play": (0.0101, 0.0102, False),
    "is wound up": (0.02, 0.022, False),
}


@pytest.mark.parametrize("name", CROSSED)
def test_faces_meet(name: str) -> None:
    begun, ended, there = CROSSED[name]
    assert met(begun, ended, GAP, CONTACT) == there
    assert met(ended, begun, GAP, CONTACT) == there
    assert met(-begun, -ended, GAP, CONTACT) == there


START = InitialCondition(load_torque_nm=12.0, angle_rad=0.3, speed_rad_s=5.0, twist_rad=0.01, load_speed_rad_s=4.0)
OUTPUTS = [(OutputKind.SPEED, Location.MOTOR), (OutputKind.SPEED, Location.LOAD), (OutputKind.POSITION, Location.MOTOR)]


@pytest.mark.parametrize(("kind", "location"), OUTPUTS)
def test_two_masses_follow_the_exact_solution(kind: OutputKind, location: Location) -> None:
    rec = linear_record(TWO_MASS, random_steps(800, seed=1), START, kind=kind, location=location)
    line = model(TWO_MASS)
    simulated_output = simulate(grid_for(line, [rec]), rec, flat(line), START)
    assert np.max(np.abs(simulated_output - rec.output)) < 2e-4 * np.ptp(rec.output)


@pytest.mark.parametrize("kind", [OutputKind.SPEED, OutputKind.POSITION])
def test_one_mass_follows_the_exact_solution(kind: OutputKind) -> None:
    rec = linear_record(ONE_MASS, random_steps(800, seed=2), START, kind=kind)
    line = model(ONE_MASS)
    simulated_output = simulate(grid_for(line, [rec]), rec, flat(line), START)
    np.testing.assert_allclose(simulated_output, rec.output, rtol=0, atol=1e-9 * np.ptp(rec.output))


def test_the_error_falls_with_the_fourth_power_of_the_sub_step() -> None:
    rec = linear_record(TWO_MASS, random_steps(300, seed=5), START)
    line = model(TWO_MASS)
    grid = grid_for(line, [rec])
    errors = [
        np.max(np.abs(simulate(replace(grid, substeps=n), rec, flat(line), START) - rec.output)) for n in (4, 8, 16)
    ]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(orders, 4.0, atol=0.3)


class TestDryFriction:
    """Coasting and sticking of one mass, J dw/dt = T - T_c sign(w)."""

    J, T_C, W_0 = 2.0, 4.0, 10.0
    LINE = model({"J_M": J, "b_M": 0.0}, effects={"coulomb_friction_motor": {"friction_nm": T_C}})
    GRID = Grid(LINE.structure, substeps=10, sign_width=1e-3)

    def run(self, torque: FloatArray, start: InitialCondition, state: int) -> FloatArray:
        return simulate(self.GRID, record(torque), flat(self.LINE), start, output=state)

    def test_coasting_stops_at_the_time_of_the_closed_formula(self) -> None:
        speed = self.run(np.zeros(700), InitialCondition(0.0, 0.0, self.W_0), state_vector.SPEED)
        time_s = np.arange(700) * SAMPLE_TIME_S
        stop_s = self.J * self.W_0 / self.T_C
        expected = np.maximum(self.W_0 - self.T_C / self.J * time_s, 0.0)
        assert stop_s == 5.0
        np.testing.assert_allclose(speed, expected, rtol=0, atol=2e-3)
        np.testing.assert_allclose(speed[:-210], expected[:-210], rtol=0, atol=1e-9)  # until 0.1 s before the stop


class TestBacklash:
    """A gap is free flight; beyond it the shaft is a spring from the edge of the gap."""

    GAP = 0.1
    VALUES = TWO_MASS | {"b_M": 0.0, "b_L": 0.0}
    LINE = model(VALUES, effects={"backlash": {"gap_rad": GAP, "contact_rad": 1e-3}})

    def run(self, torque: FloatArray, start: InitialCondition, state: int) -> FloatArray:
        rec = record(torque, np.ones(torque.size))
        return simulate(grid_for(self.LINE, [rec]), rec, flat(self.LINE), start, output=state)

    def test_the_gap_is_traversed_when_the_torque_reverses(self) -> None:
        still = TWO_MASS | {"b_M": 300.0, "b_L": 3000.0, "c": 100.0}
        line = model(still, effects={"backlash": {"gap_rad": self.GAP, "contact_rad": 1e-3}})
        torque = np.repeat([50.0, -50.0], 2500)
        rec = record(torque, np.ones(torque.size))
        load = np.repeat([0.0, -100.0], 2500)  # with the constant 50 Nm, always the torque's own opposite
        grid = replace(grid_for(line, [rec]), substeps=20)
        twist = simulate(grid, rec, flat(line), InitialCondition(50.0, 0.0, 0.0), load, output=state_vector.TWIST)
        edge = 50.0 / still["k"] + 0.5 * self.GAP
        assert twist[2499] == pytest.approx(edge, rel=1e-3)
        assert twist[-1] == pytest.approx(-edge, rel=1e-3)


def test_exact_states_agree_with_the_matrix_exponential_of_a_single_mass() -> None:
    """The yardstick itself: w(t) = T/b (1 - exp(-b t/J))."""
    torque = np.full(200, 8.0)
    speed = exact_states(ONE_MASS, torque, InitialCondition(0.0, 0.0, 0.0))[:, 1]
    time_s = np.arange(200) * SAMPLE_TIME_S
    np.testing.assert_allclose(speed, 2.0 * (1.0 - np.exp(-0.2 * time_s)), atol=1e-12)


LAST_BIT = np.finfo(float).eps


def test_the_hyperbolic_tangent_is_the_librarys_to_the_last_two_bits() -> None:
    sizes = np.concatenate([np.geomspace(1e-300, 2.0 * BEYOND, 20_000), np.linspace(0.0, 1.1 * BEYOND, 20_000)[1:]])
    for size in sizes:
        assert hyperbolic_tangent(size) == pytest.approx(math.tanh(size), rel=2.0 * LAST_BIT, abs=0.0)
        assert hyperbolic_tangent(-size) == -hyperbolic_tangent(size)


@pytest.mark.parametrize("exponent", [0.3, 1.0, 2.0, -0.5, 7.5])
def test_a_power_is_the_librarys_to_13_digits(exponent: float) -> None:
    for size in np.concatenate([np.geomspace(1e-6, 1e3, 5_000), [1.0]]):
        assert power(size, exponent) == pytest.approx(size**exponent, rel=1e-13, abs=0.0)
