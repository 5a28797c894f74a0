"""The compiled simulation against closed formulas and an exact linear solution written in the tests."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.driveline import Start
from estimator.physics.kernel import conditions, state_vector
from estimator.physics.kernel.rates import met
from estimator.physics.layout import Grid, flat, grid_for
from estimator.physics.model import DrivelineModel
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
PERIOD_S = 0.01

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


def test_hard_faces_have_no_play() -> None:
    assert met(0.0099, 0.0101, GAP, 0.0)
    assert not met(0.0101, 0.02, GAP, 0.0)


def reversing(line: DrivelineModel, finer: int) -> FloatArray:
    """Return the free run of a line whose shaft unwinds through its gap and back, again and again."""
    rec = replace(record(random_steps(400, seed=3), np.ones(400)), time_s=PERIOD_S * np.arange(400))
    coarse = grid_for(line, [rec])
    grid = Grid(line.structure, finer * coarse.substeps, coarse.sign_width)
    return simulate(grid, rec, flat(line), Start(0.0, 0.0, 0.0, 0.015, 0.0))


def error_of_steps(line: DrivelineModel) -> float:
    """Return by how much the steps of a line are off, over the RMS of its free run about its mean."""
    exact = reversing(line, 64)
    return float(np.std(reversing(line, 1) - exact) / np.std(exact))


@pytest.mark.parametrize("contact_rad", [0.0, 0.0005, 0.002])
def test_a_gap_takes_little_of_their_order_from_the_steps(contact_rad: float) -> None:
    """In steps of one size the error is 3e-3 to 4e-3 of the free run, in the smaller ones a seventh of that at most."""
    gap = {"gap_rad": 0.01, "contact_rad": contact_rad, "pull": 0.3}
    assert error_of_steps(model(TWO_MASS, effects={"backlash": gap})) < 1e-3


START = Start(load_torque_nm=12.0, angle_rad=0.3, speed_rad_s=5.0, twist_rad=0.01, load_speed_rad_s=4.0)
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


def test_a_load_over_time_acts_next_to_the_constant_one() -> None:
    torque, extra = random_steps(300, seed=3), random_steps(300, seed=4, size_nm=30.0, hold=25)
    rec = linear_record(ONE_MASS, torque, START, extra_load_nm=extra)
    line = model(ONE_MASS)
    out = simulate(grid_for(line, [rec]), rec, flat(line), START, extra)
    np.testing.assert_allclose(out, rec.output, rtol=0, atol=1e-9 * np.ptp(rec.output))


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

    def run(self, torque: FloatArray, start: Start, state: int) -> FloatArray:
        return simulate(self.GRID, record(torque), flat(self.LINE), start, output=state)

    def test_coasting_stops_at_the_time_of_the_closed_formula(self) -> None:
        speed = self.run(np.zeros(700), Start(0.0, 0.0, self.W_0), state_vector.SPEED)
        time_s = np.arange(700) * SAMPLE_TIME_S
        stop_s = self.J * self.W_0 / self.T_C
        expected = np.maximum(self.W_0 - self.T_C / self.J * time_s, 0.0)
        assert stop_s == 5.0
        np.testing.assert_allclose(speed, expected, rtol=0, atol=2e-3)
        np.testing.assert_allclose(speed[:-210], expected[:-210], rtol=0, atol=1e-9)  # until 0.1 s before the stop

    def test_strong_friction_on_a_light_mass_stays_stable(self) -> None:
        line = model({"J_M": 1e-3, "b_M": 0.0}, effects={"coulomb_friction_motor": {"friction_nm": 50.0}})
        speed = simulate(Grid(line.structure, 1, 1e-6), record(np.full(300, 25.0)), flat(line), Start(0.0, 0.0, 0.0))
        width = 50.0 * SAMPLE_TIME_S / (conditions.STICK_STABILITY * 1e-3)
        assert speed[-1] == pytest.approx(width * np.arctanh(0.5), rel=1e-6)


class TestBacklash:
    """A gap is free flight; beyond it the shaft is a spring from the edge of the gap."""

    GAP = 0.1
    VALUES = TWO_MASS | {"b_M": 0.0, "b_L": 0.0}
    LINE = model(VALUES, effects={"backlash": {"gap_rad": GAP, "contact_rad": 1e-3}})

    def run(self, torque: FloatArray, start: Start, state: int) -> FloatArray:
        rec = record(torque, np.ones(torque.size))
        return simulate(grid_for(self.LINE, [rec]), rec, flat(self.LINE), start, output=state)

    def test_the_gap_is_traversed_when_the_torque_reverses(self) -> None:
        still = TWO_MASS | {"b_M": 300.0, "b_L": 3000.0, "c": 100.0}
        line = model(still, effects={"backlash": {"gap_rad": self.GAP, "contact_rad": 1e-3}})
        torque = np.repeat([50.0, -50.0], 2500)
        rec = record(torque, np.ones(torque.size))
        load = np.repeat([0.0, -100.0], 2500)  # with the constant 50 Nm, always the torque's own opposite
        grid = replace(grid_for(line, [rec]), substeps=20)
        twist = simulate(grid, rec, flat(line), Start(50.0, 0.0, 0.0), load, output=state_vector.TWIST)
        edge = 50.0 / still["k"] + 0.5 * self.GAP
        assert twist[2499] == pytest.approx(edge, rel=1e-3)
        assert twist[-1] == pytest.approx(-edge, rel=1e-3)

    def test_a_sharp_contact_stays_finite(self) -> None:
        line = model(self.VALUES, effects={"backlash": {"gap_rad": self.GAP}})
        rec = record(random_steps(300, seed=6), np.ones(300))
        out = simulate(grid_for(line, [rec]), rec, flat(line), Start(0.0, 0.0, 0.0))
        assert np.all(np.isfinite(out))
        assert np.ptp(out) > 0.0


def test_exact_states_agree_with_the_matrix_exponential_of_a_single_mass() -> None:
    """The yardstick itself: w(t) = T/b (1 - exp(-b t/J))."""
    torque = np.full(200, 8.0)
    speed = exact_states(ONE_MASS, torque, Start(0.0, 0.0, 0.0))[:, 1]
    time_s = np.arange(200) * SAMPLE_TIME_S
    np.testing.assert_allclose(speed, 2.0 * (1.0 - np.exp(-0.2 * time_s)), atol=1e-12)
