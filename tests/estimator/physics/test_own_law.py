"""A user's own law: tried before it is used, and simulated as the same law inside the kernel is."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.errors import BadModel
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.layout import Grid, flat, flat_values, grid_for, named
from estimator.physics.model import EffectValue, Structure
from estimator.physics.own_law import TRIAL, OwnLaw, OwnParameter
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray
from tests.estimator.physics import bench

START = InitialCondition(0.0, 0.0, 30.0, 0.0, 30.0)
SIZE_OF_IT = (OwnParameter("size", "", 0.0, 0.0, 1e4, 1.0),)


def square(time_s: Any, motor_speed: Any, load_speed: Any, twist: Any, torque: Any, size: float) -> Any:
    return size * motor_speed * abs(motor_speed)


def square_by_cases(
    time_s: float, motor_speed: float, load_speed: float, twist: float, torque: float, size: float
) -> float:
    return size * motor_speed**2 if motor_speed > 0 else -size * motor_speed**2


def air(time_s: Any, motor_speed: Any, load_speed: Any, twist: Any, torque: Any, size: float) -> Any:
    return size * load_speed * abs(load_speed)


def cubic(time_s: Any, motor_speed: Any, load_speed: Any, twist: Any, torque: Any, size: float) -> Any:
    return bench.TWO_MASS["k"] * size * twist**3


def law(function: Callable[..., object], element: Element = Element.MOTOR, name: str = "mine") -> OwnLaw:
    return OwnLaw(name, function, element, SIZE_OF_IT, "laws:it")


def simulated(
    effects: dict[str, dict[str, float]], values: dict[str, float] = bench.TWO_MASS, *laws: OwnLaw
) -> FloatArray:
    names = named(laws)
    grid = Grid(Structure.TWO_MASS if "k" in values else Structure.ONE_MASS, 4, 0.02, names)
    return simulate(grid, bench.record(bench.random_steps(1500, 1)), flat_values(values, effects, names), START)


@pytest.mark.parametrize(
    ("function", "element", "size", "built_in", "closeness"),
    [
        (square, Element.MOTOR, 0.01, {"quadratic_friction": {"quadratic_nm_s2": 0.01}}, 1e-3),
        (square_by_cases, Element.MOTOR, 0.01, {"quadratic_friction": {"quadratic_nm_s2": 0.01}}, 1e-3),
        (air, Element.LOAD, 0.01, {"aerodynamic_drag": {"drag_nm_s2": 0.01}}, 1e-3),
        (cubic, Element.SHAFT, 300.0, {"stiffness_nonlinearity": {"hardening_per_rad2": 300.0, "shape": 1.0}}, 0.01),
    ],
)
def test_it_acts_as_the_same_law_of_the_kernel_does(
    function: Callable[..., object],
    element: Element,
    size: float,
    built_in: dict[str, dict[str, float]],
    closeness: float,
) -> None:
    mine = simulated({"mine": {"size": size}}, bench.TWO_MASS, law(function, element))
    known, without = simulated(built_in), simulated({})
    assert np.abs(mine - known).max() < closeness * np.abs(known - without).max()
    assert np.array_equal(simulated({"mine": {"size": 0.0}}, bench.TWO_MASS, law(function, element)), without)


def test_one_mass_has_a_motor_for_it() -> None:
    known = simulated({"quadratic_friction": {"quadratic_nm_s2": 0.01}}, bench.ONE_MASS)
    without = simulated({}, bench.ONE_MASS)
    mine = simulated({"mine": {"size": 0.01}}, bench.ONE_MASS, law(square))
    assert np.abs(mine - known).max() < 1e-3 * np.abs(known - without).max()


@pytest.mark.campaign
def test_the_output_is_smooth_enough_to_differentiate() -> None:
    at = {
        step: simulated({"mine": {"size": 0.01 * (1.0 + step)}}, bench.TWO_MASS, law(square))
        for step in (-1e-5, 0.0, 1e-5, 1e-2, -1e-2)
    }
    fine = (at[1e-5] - at[-1e-5]) / 2e-5
    coarse = (at[1e-2] - at[-1e-2]) / 2e-2
    assert fine == pytest.approx(coarse, abs=1e-3 * np.abs(coarse).max())


def test_a_law_steeper_than_the_line_can_follow_is_no_solution() -> None:
    """Its motion is beyond all that a recording has: a fit never goes there."""
    steep = law(lambda t, w, load, twist, torque, size: 1e9 * size * np.tanh(w / 1e-3))
    ran_to = np.abs(np.nan_to_num(simulated({"mine": {"size": 1.0}}, bench.TWO_MASS, steep), nan=np.inf)).max()
    assert ran_to > 1e3 * np.abs(simulated({})).max()


def test_one_that_can_not_be_compiled_is_called_back_and_acts_alike() -> None:
    """What it raises in the middle of a simulation is raised once that is over."""

    def by_text(t: float, w: float, load: float, twist: float, torque: float, size: float) -> float:
        return size * float(f"{w!r}") * abs(w)

    def fails_late(t: float, w: float, load: float, twist: float, torque: float, size: float) -> float:
        if t > 5.0:
            raise ValueError("no map for so late")
        return size * w

    called, compiled = (simulated({"mine": {"size": 0.01}}, bench.TWO_MASS, law(each)) for each in (by_text, square))
    np.testing.assert_allclose(called, compiled, rtol=1e-12)
    with pytest.raises(BadModel, match=r"laws.mine.function laws:it: failed with ValueError: no map for so late"):
        simulated({"mine": {"size": 0.01}}, bench.TWO_MASS, law(fails_late))


def test_a_law_that_failed_in_one_simulation_is_asked_again_in_the_next() -> None:
    def fails_late(t: float, w: float, load: float, twist: float, torque: float, size: float) -> float:
        if t > 5.0:
            raise ValueError("no map for so late")
        return size * w

    grid = Grid(Structure.TWO_MASS, 4, 0.02, named([law(fails_late)]))
    p = flat_values(bench.TWO_MASS, {"mine": {"size": 0.01}}, grid.laws)
    long, short = (bench.record(bench.random_steps(count, 1)) for count in (1500, 100))
    with pytest.raises(BadModel, match="no map for so late"):
        simulate(grid, long, p, START)
    assert np.isfinite(simulate(grid, short, p, START)).all()


def test_a_law_belongs_to_its_model_and_to_no_other() -> None:
    """Two models have laws of the same name, a third has none; whichever was made last changes nothing."""
    effects = {"mine": {"size": 0.01}}
    first, second = (
        replace(bench.model(bench.TWO_MASS), laws=named([law(function, element)]))
        for function, element in ((square, Element.MOTOR), (air, Element.LOAD))
    )
    rec = bench.record(bench.random_steps(500, 1), np.full(500, 30.0))
    known = {"quadratic_friction": {"quadratic_nm_s2": 0.01}}, {"aerodynamic_drag": {"drag_nm_s2": 0.01}}
    for owner, built_in in zip((first, second, first), (*known, known[0]), strict=True):
        line = replace(owner, effects={"mine": {"size": EffectValue(0.01)}})
        grid = replace(grid_for(line, [rec]), substeps=4)
        mine = simulate(grid, rec, flat(line), START)
        bare = replace(grid, laws=())
        alike, without = (simulate(bare, rec, flat_values(bench.TWO_MASS, e), START) for e in (built_in, {}))
        assert np.abs(mine - alike).max() < 1e-3 * np.abs(alike - without).max()
    assert "mine" in open_hypotheses(first, [rec])[0]
    assert "mine" not in open_hypotheses(bench.model(bench.TWO_MASS), [rec])[0]
    with pytest.raises(BadModel, match=r"effects.mine: unknown effect"):
        bench.model(bench.TWO_MASS, effects=effects)


@pytest.mark.parametrize("names", [["backlash"], ["mine", "mine"]])
def test_a_name_that_is_taken_is_refused(names: list[str]) -> None:
    with pytest.raises(BadModel, match="not in the catalogue and comes once"):
        named([law(square, name=name) for name in names])


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda motor_speed, size: size, r"expected a function of \(time_s, .*, size\), got one that does not fit"),
        (lambda t, w, load, twist, torque, other: 0.0, "does not fit"),
        (lambda t, w, load, twist, torque, size: size * float("nan"), "expected a finite number, got nan at time_s = "),
        (
            lambda t, w, load, twist, torque, size: size / w,
            "expected a finite number, got inf|failed with ZeroDivisionError",
        ),
        (lambda t, w, load, twist, torque, size: size * math.log(w), "failed with ValueError"),
        (lambda t, w, load, twist, torque, size: "much", "failed with ValueError"),
        (lambda t, w, load, twist, torque, size: 1.0 + size, "expected 0 where size is 0 .* got 1"),
    ],
)
def test_a_function_that_can_not_be_used_is_refused(function: Callable[..., object], said: str) -> None:
    with pytest.raises(BadModel, match=f"laws.mine.function laws:it: .*({said})"):
        law(function)


@pytest.mark.parametrize(
    ("parameters", "element", "said"),
    [
        ((), Element.MOTOR, "parameters: expected at least one"),
        (SIZE_OF_IT, Element.TORQUE_PATH, "element: expected one of motor, shaft, load, speed_sensor, got torque_path"),
        ((OwnParameter("size", "", 0.0, 2.0, 1.0, 1.0),), Element.MOTOR, "expected low <= start <= high"),
        ((OwnParameter("size", "", 0.0, 0.0, math.inf, 1.0),), Element.MOTOR, "expected finite numbers"),
        ((OwnParameter("size", "", 0.0, 0.0, 1.0, 0.0),), Element.MOTOR, "a start other than it"),
        ((OwnParameter("size", "", 0.0, 1.0, 2.0, 1.0),), Element.MOTOR, "a null inside its bounds"),
    ],
)
def test_a_definition_without_sense_is_refused(
    parameters: tuple[OwnParameter, ...], element: Element, said: str
) -> None:
    with pytest.raises(BadModel, match=said):
        OwnLaw("mine", square, element, parameters)


def test_functions_of_arrays_are_reported_from_functions_of_numbers() -> None:
    assert law(square).takes_arrays
    assert not law(square_by_cases).takes_arrays
    for function in (square, square_by_cases):
        assert law(function)(TRIAL, {"size": 2.0}) == pytest.approx(2.0 * TRIAL[1] * np.abs(TRIAL[1]))


def test_a_function_of_numbers_is_compiled_where_that_can_be() -> None:
    """What can't be compiled is called as it is: here a text in between."""

    def by_text(t: float, w: float, load: float, twist: float, torque: float, size: float) -> float:
        return size * float(f"{w:.6f}")

    assert law(square_by_cases).compiled is not None
    assert law(by_text).compiled is None
    assert law(by_text)(TRIAL, {"size": 2.0}) == pytest.approx(2.0 * TRIAL[1])
