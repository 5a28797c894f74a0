"""Structures of three masses and of one, with effects at their places, against the reference."""

from collections.abc import Callable

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.kernel import state_vector
from estimator.physics.layout import Grid, flat_values
from estimator.physics.model import Structure
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray
from tests.estimator.physics import reference
from tests.estimator.physics.bench import ONE_MASS, SAMPLE_TIME_S, THREE_MASS
from tests.estimator.physics.law_bench import SIGN_WIDTH, SUBSTEPS, TIME_S, TORQUE, assert_same, measured
from tests.estimator.physics.reference import Held, lasting

START = InitialCondition(12.0, 0.0, 1.5, 0.004, 1.4, 0.003, 1.45)
Law = Callable[[float, float], float]


def three_masses(
    friction: Law = lambda t, w: 0.0, drag: Law = lambda t, w: 0.0, shaft: Law | None = None
) -> reference.Rhs:
    v = THREE_MASS

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        _, w_M, twist, w_L, twist_2, w_2 = x
        T_S = v["k"] * twist + v["c"] * (w_M - w_2) if shaft is None else shaft(twist, w_M - w_2)
        T_2 = v["k_2"] * twist_2 + v["c_2"] * (w_2 - w_L)
        return np.array(
            [
                w_M,
                (torque - v["b_M"] * w_M - friction(t, w_M) - T_S) / v["J_M"],
                w_M - w_2,
                (T_2 - v["b_L"] * w_L - drag(t, w_L) - START.load_torque_nm) / v["J_L"],
                w_2 - w_L,
                (T_S - T_2) / v["J_2"],
            ]
        )

    return rhs


def states(rhs: reference.Rhs, events_s: tuple[float, ...] = ()) -> FloatArray:
    start = np.array([0.0, 1.5, 0.004, 1.4, 0.003, 1.45])
    return reference.solve(rhs, start, Held.of(TORQUE, SAMPLE_TIME_S), TIME_S, events_s)


def three_mass_output(effects: dict[str, dict[str, float]], output: int = state_vector.SPEED) -> FloatArray:
    grid = Grid(Structure.THREE_MASS, SUBSTEPS, SIGN_WIDTH)
    return simulate(grid, measured(), flat_values(THREE_MASS, effects), START, output=output)


@pytest.mark.parametrize("state", [state_vector.ANGLE, state_vector.SPEED, state_vector.TWIST, state_vector.LOAD_SPEED])
def test_three_masses_follow_newtons_law(state: int) -> None:
    expected = states(three_masses())[:, state]
    out = three_mass_output({}, state)
    assert np.max(np.abs(out - expected)) < 1e-5 * np.ptp(expected)


def test_the_first_shaft_of_three_masses_may_have_a_gap() -> None:
    gap, depth = 0.02, 2e-3
    k, c = THREE_MASS["k"], THREE_MASS["c"]

    def shaft(twist: float, rate: float) -> float:
        beyond = np.sign(twist) * max(abs(twist) - 0.5 * gap, 0.0)
        torque = float(k * beyond + c * (1.0 - np.exp(-abs(beyond) / depth)) * rate)
        return torque if torque * beyond > 0.0 else 0.0

    out = three_mass_output({"backlash": {"gap_rad": gap, "contact_rad": depth}})
    assert_same(out, states(three_masses(shaft=shaft))[:, 1], three_mass_output({}), tolerance=1e-3)


def one_mass_output(effects: dict[str, dict[str, float]], turning: FloatArray) -> FloatArray:
    grid = Grid(Structure.ONE_MASS, SUBSTEPS, SIGN_WIDTH)
    return simulate(grid, measured(turning), flat_values(ONE_MASS, effects), InitialCondition(12.0, 0.0, 1.5))


ONE_MASS_EFFECTS: dict[str, tuple[dict[str, dict[str, float]], Law, Law]] = {
    "generator": (
        {"generator_coupled": {"inertia_kg_m2": 15.0, "from_s": 0.5, "to_s": 1.6}},
        lambda t, w: 0.0,
        lambda t, w: lasting(15.0, 0.5, 1.6)(t),
    ),
    "payload": (
        {"inertia_change": {"change_kg_m2": -8.0, "from_s": 0.5, "to_s": 1.6}},
        lambda t, w: 0.0,
        lambda t, w: lasting(-8.0, 0.5, 1.6)(t),
    ),
    "drag": (
        {"aerodynamic_drag": {"drag_nm_s2": 1.5}, "quadratic_friction": {"quadratic_nm_s2": 1.0}},
        lambda t, w: 2.5 * w * abs(w),
        lambda t, w: 0.0,
    ),
    "brake": (
        {"brake_drag": {"brake_nm": 60.0, "from_s": 0.5, "to_s": 1.6}},
        lambda t, w: lasting(60.0, 0.5, 1.6)(t) * np.tanh(w / SIGN_WIDTH),
        lambda t, w: 0.0,
    ),
    "warming": (
        {"warming_friction": {"cold_nm_s": 25.0, "time_constant_s": 0.7}},
        lambda t, w: 25.0 * np.exp(-t / 0.7) * w,
        lambda t, w: 0.0,
    ),
    "imbalance": (
        {"load_imbalance": {"amplitude_nm": 60.0, "motor_turns_per_turn": 2.0, "phase_rad": 0.4}},
        lambda t, w: 60.0 * np.cos(10.0 * t / 2.0 + 0.4),
        lambda t, w: 0.0,
    ),
    "ripple": (
        {"torque_ripple": {"amplitude_nm": 60.0, "order": 1.0, "phase_rad": 0.4}},
        lambda t, w: -60.0 * np.cos(10.0 * t + 0.4),
        lambda t, w: 0.0,
    ),
}


@pytest.mark.parametrize("name", ONE_MASS_EFFECTS)
def test_one_mass_carries_what_has_no_shaft(name: str) -> None:
    effects, drag, more = ONE_MASS_EFFECTS[name]

    def rhs(t: float, x: FloatArray, torque: float) -> FloatArray:
        inertia = ONE_MASS["J_M"] + more(t, x[0])
        return np.array([(torque - ONE_MASS["b_M"] * x[0] - drag(t, x[0]) - 12.0) / inertia])

    expected = reference.solve(rhs, np.array([1.5]), Held.of(TORQUE, SAMPLE_TIME_S), TIME_S, (0.5, 1.6))[:, 0]
    turning = np.full(TIME_S.size, 10.0)
    assert_same(one_mass_output(effects, turning), expected, one_mass_output({}, turning))
