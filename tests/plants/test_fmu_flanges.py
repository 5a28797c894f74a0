"""Laws at an FMU's shafts: the same motion as where they are written into the line."""

import shutil
from typing import Any

import numpy as np
import pytest

from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.layout import flat, grid_for
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import simulate
from hil.export.fmu import package
from hil.export.fmu.driveline import driveline
from hil.plants.fmu_line import NOTHING, FmuLine, _around
from hil.plants.fmu_plant import FmuPlant
from tests.estimator.physics import bench

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")

FINER = 32
"""Steps to a sample of what is wanted: at a sampling period's own dry friction is off by as much as is allowed."""


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def around(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> DrivelineModel:
    """Return a model around the FMU of a two-mass line."""
    path = tmp_path_factory.mktemp("exported") / "drive.fmu"
    package.write(driveline("drive", bench.model(bench.TWO_MASS), 0.01), request.param, path)
    fmu = FmuPlant(path, [], trusted=True)
    record = bench.record(np.zeros(10))
    named = fmu.named(record.kind)
    return _around(record, FmuLine(fmu, bench.model(bench.TWO_MASS, 0.0), named, 1.0, 1.0, {}))


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction_motor", {"friction_nm": 25.0}),
        ("stribeck_friction", {"coulomb_nm": 8.0, "excess_nm": 10.0, "stribeck_rad_s": 2.0}),
        ("asymmetric_friction", {"difference_nm_s": 0.4}),
        ("coulomb_friction_load", {"friction_nm": 25.0}),
        ("aerodynamic_drag", {"drag_nm_s2": 0.5}),
        ("warming_friction", {"cold_nm_s": 5.0, "time_constant_s": 3.0}),
        ("generator_coupled", {"inertia_kg_m2": 0.5, "from_s": 1.0, "to_s": 2.5}),
        ("inertia_change", {"change_kg_m2": -15.0, "from_s": 1.0, "to_s": 2.5}),
        ("brake_drag", {"brake_nm": 30.0, "from_s": 1.0, "to_s": 2.5}),
    ],
)
def test_a_law_at_a_shaft_moves_it_as_the_line(around: Any, name: str, values: dict[str, float]) -> None:
    torque = bench.random_steps(400, 3, 60.0, hold=20)
    record = bench.record(torque[:, None] / 2 @ np.ones((1, 2)))
    own = bench.model(bench.TWO_MASS, effects={name: values})
    start = InitialCondition(0.0, 0.0, 2.0, load_speed_rad_s=2.0)
    fine = bench.record(np.repeat(record.torque_nm, FINER, axis=0), sample_time_s=record.sample_time_s / FINER)
    wanted = simulate(grid_for(own, [fine]), fine, flat(own), start)[::FINER]
    without = simulate(grid_for(own, [record]), record, flat(bench.model(bench.TWO_MASS)), start)
    found = around.plant.simulated(record, [Case(flat(own), start)])[0]
    allowed = NOTHING * float(np.ptp(wanted))
    assert np.ptp(wanted - without) > 10.0 * allowed
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=allowed)
