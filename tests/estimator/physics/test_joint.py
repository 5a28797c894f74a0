"""A joint on a bench: its torque under an imposed motion, against answers worked out by hand."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import fit
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import FloatArray, OutputKind, Record

STIFFNESS, DAMPING = 1000.0, 5.0
PERIOD_S = 0.001
REST = InitialCondition(0.0, 0.0, 0.0)
MODEL = DrivelineModel(Structure.JOINT, {"k": Parameter(STIFFNESS, 0.5), "c": Parameter(DAMPING, 0.5)})


def recording(twist: FloatArray, torque: FloatArray | None = None) -> Record:
    output = np.sin(np.arange(twist.size)) if torque is None else torque
    time_s = PERIOD_S * np.arange(float(twist.size))
    okay = np.ones(twist.size, dtype=np.bool_)
    return Record("bench", PERIOD_S, time_s, output[:, None], output, okay, OutputKind.FORCE, imposed=twist)


def up_and_down(amplitude: float, rows: int = 4001, rounds: int = 2) -> FloatArray:
    """A triangle: from 0 to the amplitude, to its negative and back."""
    corners = np.linspace(0.0, rounds, 4 * rounds + 1)
    values = amplitude * np.sin(0.5 * np.pi * np.arange(4 * rounds + 1))
    return np.asarray(np.interp(np.linspace(0.0, rounds, rows), corners, values))


def torque(
    twist: FloatArray, effects: dict[str, dict[str, float]], damping: float = 0.0, start: InitialCondition = REST
) -> FloatArray:
    record = recording(twist)
    p = flat_values({"k": STIFFNESS, "c": damping}, effects)
    return simulate(grid_for(MODEL, [record]), record, p, start)


def test_a_slider_follows_its_law_and_forgets_where_it_began() -> None:
    twist, yield_rad, friction = up_and_down(0.1), 0.02, 40.0
    slider = {"shaft_hysteresis": {"friction_nm": friction, "yield_rad": yield_rad}}
    found = torque(twist, slider) - STIFFNESS * twist
    rising = slice(0, 501)  # the first quarter: z = 1 - exp(-x / y) from rest
    assert found[rising] == pytest.approx(friction * (1.0 - np.exp(-twist[rising] / yield_rad)), abs=1e-6)
    forgotten = friction * np.exp(-0.2 / yield_rad)  # by the first turn, and over one stroke more
    assert found[3000:4000] == pytest.approx(found[1000:2000], abs=forgotten)


@pytest.mark.parametrize(("yield_rad", "within"), [(0.02, 1e-6), (1e-4, 1e-3)])
def test_a_slider_of_any_shape_follows_its_law(yield_rad: float, within: float) -> None:
    """Sharp, soft on the way back and partly in the spring, against scipy; one yields within a fraction of a sample."""
    twist, friction, sharpness, unloading = up_and_down(0.1), 1.0, 3.0, 0.4

    def law(_: float, z: FloatArray, direction: float) -> FloatArray:
        back = direction * z[0] < 0.0
        yielded = (-unloading if back else 1.0) * min(abs(z[0]), 1.0) ** sharpness
        return np.array([direction * (1.0 - yielded) / yield_rad])

    z = [0.0]
    for begin, end in pairwise(twist[::500]):
        way = np.linspace(0.0, abs(end - begin), 501)
        direction = float(np.sign(end - begin))
        stroke = solve_ivp(law, way[[0, -1]], z[-1:], args=(direction,), t_eval=way, rtol=1e-9, atol=1e-12)
        z += stroke.y[0, 1:].tolist()
    shape = {"sharpness": sharpness, "unloading": unloading, "inside": 0.3}
    found = torque(twist, {"shaft_hysteresis": {"friction_nm": friction, "yield_rad": yield_rad, **shape}})
    stiffness = max(STIFFNESS - 0.3 * friction / yield_rad, 0.0)
    assert found == pytest.approx(stiffness * twist + friction * np.array(z), abs=within * friction)


@pytest.mark.parametrize(("offset", "preload"), [(0.0, 100.0), (70.0, 100.0), (70.0, 0.0)])
def test_an_open_gap_shows_the_zero_of_the_load_cell_and_no_preload(offset: float, preload: float) -> None:
    """A preloaded slider yields at another torque one way than the other; in between the torque is none."""
    gap, friction = 0.03, 500.0
    slider = {"friction_nm": friction, "yield_rad": 1e-3}
    record = recording(up_and_down(0.1, 20001))
    p = flat_values({"k": 1e-3, "c": 0.0}, {"backlash": {"gap_rad": gap}, "shaft_hysteresis": slider})
    found = (
        simulate(grid_for(MODEL, [record]), record, p, InitialCondition(offset, 0.0, 0.0, preload_nm=preload)) + offset
    )
    assert found.max() == pytest.approx(friction - preload, rel=1e-3)
    assert found.min() == pytest.approx(-friction - preload, rel=1e-3)
    assert record.imposed is not None
    travelled = np.abs(np.diff(record.imposed, prepend=0.0))
    assert travelled[2500:7500][np.abs(found[2500:7500]) < 1e-6 * friction].sum() == pytest.approx(gap, rel=0.01)


def test_a_gap_in_series_with_a_slider_moves_with_it() -> None:
    """At every turn the torque falls to nothing, the gap is crossed at no torque, wherever the slider has got to."""
    gap, yield_rad, friction = 0.03, 1e-4, 500.0
    record = recording(up_and_down(0.1, 20001) + 0.4)
    p = flat_values(
        {"k": 1e-3, "c": 0.0},
        {"backlash": {"gap_rad": gap}, "shaft_hysteresis": {"friction_nm": friction, "yield_rad": yield_rad}},
    )
    found = simulate(grid_for(MODEL, [record]), record, p, InitialCondition(0.0, 0.0, 0.0))
    assert record.imposed is not None
    travelled = np.abs(np.diff(record.imposed, prepend=record.imposed[0]))
    silent = np.abs(found) < 1e-3 * friction
    turns = [2500, 7500, 12500]
    for begin, end in zip(turns, [*turns[1:], 17500], strict=True):
        crossing = silent[begin:end]
        assert float(travelled[begin:end][crossing].sum()) == pytest.approx(gap, abs=2e-4)
        assert float(np.abs(found[end - 10])) == pytest.approx(friction, rel=1e-3)


def test_a_fit_finds_spring_damper_gap_and_offset_again() -> None:
    phase = np.arange(4000) * PERIOD_S
    twist = 0.1 * np.sin(2.0 * np.pi * phase) * (1.0 + phase) / 4.0
    true = DrivelineModel(Structure.JOINT, {"k": Parameter(1200.0, 0.0), "c": Parameter(6.0, 0.0)})
    clean = simulate(
        grid_for(true, [recording(twist)]),
        recording(twist),
        flat_values(true.values(), {}),
        InitialCondition(7.0, 0.0, 0.0, 0.0),
    )
    noise = 0.1 * np.random.default_rng(5).standard_normal(clean.size)
    found = fit(make_problem(MODEL, [recording(twist, clean + noise)], nominal_unknowns(MODEL)))
    assert found.value("", "k") == pytest.approx(1200.0, rel=1e-3)
    assert found.value("", "c") == pytest.approx(6.0, rel=1e-2)
    assert found.rms == pytest.approx(0.1, rel=0.05)
