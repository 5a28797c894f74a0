"""Roads, drivers and the experiments on them."""

from pathlib import Path

import numpy as np
import pytest

from hil.figures.local_model import TwoMassLine
from hil.figures.road import (
    AIR_KG_M3,
    DRAG_AREA_M2,
    GRAVITY_M_S2,
    LONGEST_S,
    ROLLING,
    Bus,
    Conditions,
    PedalCruise,
    RoadLoad,
    RoadPlant,
    draw_conditions,
    drive,
)
from hil.recording import read_record
from hil.rig.experiments.laws import Cruise
from hil.rig.stop import StopRequest

BUS = Bus(mass_kg=13_600.0, metres_per_rad=0.48 / 5.6)
CALM = Conditions(80.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, prbs_seed=1, seed=3)
LINE = TwoMassLine(1.6, 100.0, 4200.0, 9.0, 0.35, 0.9)
PERIOD_S = 0.01


def loads(conditions: Conditions, speed_rad_s: float = 80.0, count: int = 60_000) -> np.ndarray:
    load = RoadLoad(BUS, conditions)
    step_m = speed_rad_s * BUS.metres_per_rad * PERIOD_S
    return np.array([load.torque_nm(speed_rad_s, k * step_m, PERIOD_S) for k in range(count)])


def test_a_level_road_without_wind_takes_what_the_laws_say() -> None:
    v = 80.0 * BUS.metres_per_rad
    force_n = ROLLING * BUS.mass_kg * GRAVITY_M_S2 + 0.5 * AIR_KG_M3 * DRAG_AREA_M2 * v * v
    assert loads(CALM, count=3) == pytest.approx(force_n * BUS.metres_per_rad)


@pytest.mark.parametrize(
    ("changed", "spread_nm"),
    [({"slope_rms": 0.003}, 0.003 * BUS.mass_kg * GRAVITY_M_S2 * BUS.metres_per_rad), ({"roughness_nm": 8.0}, 8.0)],
)
def test_road_and_surface_spread_as_they_are_reported(changed: dict[str, float], spread_nm: float) -> None:
    conditions = Conditions(**{**{name: getattr(CALM, name) for name in CALM.__slots__}, **changed})
    assert loads(conditions).std() == pytest.approx(spread_nm, rel=0.15)


def test_the_plant_holds_a_speed_at_the_torque_that_balances_the_load() -> None:
    load_nm = loads(CALM, count=1)[0]
    plant = RoadPlant(LINE, RoadLoad(BUS, CALM), BUS.metres_per_rad, 80.0, PERIOD_S)
    holding_nm = load_nm + (0.35 + 0.9) * 80.0
    for _ in range(500):
        plant.advance((0.5 * holding_nm, 0.5 * holding_nm), PERIOD_S)
    assert plant.speed_rad_s == pytest.approx(80.0, abs=0.05)
    with pytest.raises(ValueError, match=r"a step of 0\.02 s, expected the 0\.01 s"):
        plant.advance((0.0, 0.0), 0.02)


def test_conditions_differ_and_do_not_depend_on_how_many_are_drawn() -> None:
    eight = draw_conditions(1, 8)
    assert draw_conditions(1, 3) == eight[:3]
    assert len({each.speed_rad_s for each in eight}) == 8
    assert draw_conditions(2, 1) != eight[:1]


def test_a_driver_corrects_with_a_lag_and_ends_no_cruise() -> None:
    cruise = Cruise(80.0, 30.0, 100.0, 500.0, PERIOD_S)
    law = PedalCruise(cruise, 20.0, PERIOD_S, np.random.default_rng(5))
    assert (law.start_speed_rad_s, law.duration_s) == (80.0, 30.0)
    law.begin(200.0)
    torque = np.array([law.torque_nm(k * PERIOD_S, 80.0) for k in range(3000)])
    assert torque[0] == pytest.approx(200.0)
    steps = np.abs(np.diff(torque))
    assert steps.max() < 20.0 * 4 * PERIOD_S / 0.25  # four deviations through a first-order lag of 0.25 s
    moved = np.abs(torque[:: int(LONGEST_S / PERIOD_S)] - 200.0)
    assert moved.max() > 1.0


@pytest.mark.campaign
def test_an_experiment_is_recorded_over_the_protocols_and_the_same_seed_makes_the_same_file(tmp_path: Path) -> None:
    conditions = draw_conditions(4, 1)[0]
    first = drive(tmp_path / "a.csv", conditions, 3.0, StopRequest())
    again = drive(tmp_path / "b.csv", conditions, 3.0, StopRequest())
    assert first.path.read_bytes() == again.path.read_bytes()
    record = read_record(first.path)
    assert record.okay.all()
    assert record.time_s.shape == (300,)
    assert record.output.mean() == pytest.approx(conditions.speed_rad_s, rel=0.1)
    assert np.ptp(record.total_torque_nm) > 200.0  # the PRBS of 120 Nm either way
    assert first.line.inertia_load_kg_m2 == pytest.approx(100.0 + conditions.payload_kg * BUS.metres_per_rad**2)


def test_a_stop_ends_an_experiment(tmp_path: Path) -> None:
    stop = StopRequest()
    stop.request()
    with pytest.raises(KeyboardInterrupt):
        drive(tmp_path / "a.csv", draw_conditions(4, 1)[0], 3.0, stop)
    assert list(tmp_path.iterdir()) == []
