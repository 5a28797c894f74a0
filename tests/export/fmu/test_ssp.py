"""An FMU with what was found around it, as an SSP: the two together move as the line that has the effects itself."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat, grid_for
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Record
from hil.export.fmu import package
from hil.export.fmu.driveline import driveline
from hil.export.fmu.ssp import augmented_ssp
from hil.plants.fmu_line import FmuLine
from hil.plants.fmu_plant import FmuPlant
from tests.chosen import one_in
from tests.estimator.physics import bench

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")

STEP_S, PERIOD_S, SAMPLES = 0.001, 0.01, 400
AGREES = 0.01
"""Of the output's range, at that step."""

EFFECTS = {
    "path and sensor": {"inverter_gain_mismatch": {"gain_m2": 0.7}, "speed_filter": {"time_constant_s": 0.05}},
    "late, dry": {"transport_delay": {"delay_s": 0.03}, "coulomb_friction_motor": {"friction_nm": 25.0}},
    "at the load": {"coulomb_friction_load": {"friction_nm": 25.0}, "aerodynamic_drag": {"drag_nm_s2": 0.5}},
    "inertias": {"generator_coupled": {"inertia_kg_m2": 0.5, "from_s": 1.0, "to_s": 2.5}},
}


def by_fmpy(path: Path, torque: FloatArray) -> FloatArray:
    from fmpy.ssp.simulation import simulate_ssp

    def held(column: FloatArray) -> Any:
        return lambda time_s: column[min(int(time_s / PERIOD_S + 1e-6), SAMPLES - 1)]

    given = {"T_M1": held(torque[:, 0]), "T_M2": held(torque[:, 1])}
    found = simulate_ssp(path, stop_time=SAMPLES * PERIOD_S, step_size=STEP_S, input=given)
    return np.interp(np.arange(SAMPLES) * PERIOD_S, found["time"], found["speed_measured"])


def written(effects: Mapping[str, Mapping[str, float]], record: Record, folder: Path) -> Path | None:
    """Write an SSP of the FMU of a two-mass line with some effects, if it can hold them."""
    line, fmu, path = bench.model(bench.TWO_MASS), folder / "drive.fmu", folder / "augmented.ssp"
    package.write(driveline("drive", line, PERIOD_S), "2.0", fmu)
    plant = FmuPlant(fmu, ["output=speed_motor"], trusted=True)
    diagnosis: Any = SimpleNamespace(augmented=bench.model(bench.TWO_MASS, effects=effects), parameters={})
    write = augmented_ssp(diagnosis, FmuLine(plant, line, plant.named(record.kind), 0.0, 1.0, {}), fmu, record)
    if write is None:
        return None
    write(path)
    return path


@pytest.mark.parametrize("name", one_in(2, EFFECTS))
def test_the_two_move_as_the_line_with_the_effects(name: str, tmp_path: Path) -> None:
    torques = np.column_stack([bench.random_steps(SAMPLES, seed, 60.0, hold=20) for seed in (3, 4)])
    torques[: SAMPLES // 100] = 0.0  # before the importer has connected the two
    ssp = written(EFFECTS[name], bench.record(torques), tmp_path)
    assert ssp is not None
    parts = round(PERIOD_S / STEP_S)
    fine = bench.record(np.repeat(torques, parts, axis=0), sample_time_s=STEP_S)
    augmented, start = bench.model(bench.TWO_MASS, effects=EFFECTS[name]), InitialCondition(0.0, 0.0, 0.0)
    wanted = simulate(grid_for(augmented, [fine]), fine, flat(augmented), start)[::parts]
    allowed = AGREES * float(np.ptp(wanted))
    without = simulate(grid_for(augmented, [fine]), fine, flat(bench.model(bench.TWO_MASS)), start)[::parts]
    assert np.ptp(wanted - without) > 10.0 * allowed
    np.testing.assert_allclose(by_fmpy(ssp, torques), wanted, rtol=0.0, atol=allowed)


def test_what_is_inside_is_not_put_around(tmp_path: Path) -> None:
    assert written({"backlash": {"gap_rad": 0.01}}, bench.record(np.zeros(10)), tmp_path) is None
