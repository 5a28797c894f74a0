"""FMUs of other kinds than those of ``hil export fmu``: arrays, clocks, another platform, events without end."""

import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat, grid_for
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.simulate import simulate
from hil.errors import UsageError
from hil.export.fmu import package
from hil.export.fmu.driveline import driveline
from hil.plants.fmu_plant import FmuPlant
from hil.plants.fmu_process import MOST_EVENTS, _Progress
from tests.estimator.physics import bench
from tests.estimator.physics.bench import THREE_MASS, TWO_MASS, model, random_steps
from tests.plants.test_fmu_faults import DESCRIPTION

pytest.importorskip("fmpy")
COMPILES = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")

SCALARS = "return n == count ? {}_reals(D, r, n, value) : fmi3Error;"
ARRAYS = """
    fmi3ValueReference each[16];
    size_t m = 0;
    for (size_t i = 0; i < n; i++) {{
        each[m++] = r[i];
        if (r[i] == {first}) each[m++] = r[i] + 1;
    }}
    return m == count ? {what}_reals(D, each, m, value) : fmi3Error;"""


def exported(folder: Path, version: str = "3.0") -> Path:
    model = DrivelineModel(Structure.TWO_MASS, {name: Parameter(value, 0.2) for name, value in TWO_MASS.items()})
    package.write(driveline("drive", model, 0.1), version, folder / "drive.fmu")
    return folder / "drive.fmu"


def described(path: Path, change: Callable[[str], str]) -> Path:
    """Change the description of an FMU."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            text = change(content.decode()).encode() if name == "modelDescription.xml" else content
            archive.writestr(name, text)
    return path


@COMPILES
def test_an_array_is_driven_by_its_elements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scalar").mkdir()
    scalar = FmuPlant(exported(tmp_path / "scalar"), ["torque=T_M1", "start=start.speed"], trusted=True)
    with zipfile.ZipFile(tmp_path / "scalar" / "drive.fmu") as archive:
        text = archive.read("modelDescription.xml").decode()
    first = int(re.search(r'name="T_M1" valueReference="(\d+)"', text)[1])  # type: ignore[index]
    own = package.own

    def arrays(name: str) -> str:
        source = own(name)
        for what in ("get", "set") if name == "fmi3.c" else ():
            assert SCALARS.format(what) in source
            source = source.replace(SCALARS.format(what), ARRAYS.format(first=first, what=what))
        return source

    def as_array(text: str) -> str:
        text = re.sub(r'<Float64 name="T_M2".*?/>', "", text, flags=re.DOTALL)
        changed = re.sub(
            r'<Float64 name="T_M1"(.*?)start="[^"]*" */>',
            r'<Float64 name="u"\1start="0 0"><Dimension start="2"/></Float64>',
            text,
            flags=re.DOTALL,
        )
        assert "Dimension" in changed
        return changed

    monkeypatch.setattr(package, "own", arrays)
    array = FmuPlant(described(exported(tmp_path), as_array), ["torque=u[1],u[2]", "load="], trusted=True)
    torque = np.column_stack([random_steps(100, 1), np.zeros(100)])
    record = bench.record(torque)
    names = array.named(record.kind)
    assert names.torque == ("u[1]", "u[2]")
    halves = array.simulated(record, names, record.torque_nm, {})
    only = FmuPlant(tmp_path / "drive.fmu", ["torque=u[2]", "load="], trusted=True)
    second = only.simulated(record, only.named(record.kind), record.torque_nm, {})
    reference = scalar.simulated(record, scalar.named(record.kind), record.torque_nm, {"start.speed": 0.0})
    np.testing.assert_allclose(halves, reference, rtol=1e-12)
    np.testing.assert_allclose(second, reference, rtol=1e-12)
    assert np.ptp(reference) > 0.1
    load = np.linspace(0.0, 20.0, 100)
    mixed = FmuPlant(tmp_path / "drive.fmu", ["torque=u[1],u[2]"], trusted=True)
    assert mixed.is_input("T_load")
    loaded, expected = (
        each.simulated(record, each.named(record.kind), record.torque_nm, {"T_load": load}) for each in (mixed, scalar)
    )
    np.testing.assert_allclose(loaded, expected, rtol=1e-12)
    assert np.abs(loaded - reference).max() > 0.1


THREE_MASSES = DrivelineModel(
    Structure.THREE_MASS, {name: Parameter(THREE_MASS[name], 0.2) for name in Structure.THREE_MASS.parameter_names}
)
WITH_EVENTS = model(TWO_MASS, effects={"backlash": {"gap_rad": 0.02}, "coulomb_friction_motor": {"friction_nm": 8.0}})


@COMPILES
@pytest.mark.parametrize("of", [THREE_MASSES, WITH_EVENTS], ids=["three masses", "a gap and dry friction"])
def test_what_is_exported_is_simulated_as_here(of: DrivelineModel, tmp_path: Path) -> None:
    """A gap opens and closes, and dry friction sticks, between the periods: the FMU has these events inside a step."""
    record = bench.record(random_steps(200, 1, size_nm=40.0))
    package.write(driveline("drive", of, record.sample_time_s), "3.0", tmp_path / "drive.fmu")
    plant = FmuPlant(tmp_path / "drive.fmu", ["torque=T_M1"], trusted=True)
    grid = grid_for(of, [record])
    width = {"sign_width": grid.sign_width} if of.effects else {}  # of dry friction: here by the recording's speeds
    simulated = plant.simulated(record, plant.named(record.kind), record.torque_nm, width)
    here = simulate(grid, record, flat(of), InitialCondition(0.0, 0.0, 0.0))
    assert np.ptp(here) > 0.1
    np.testing.assert_allclose(simulated, here, atol=1e-6 * np.ptp(here))


@COMPILES
def test_a_clock_is_refused_by_name(tmp_path: Path) -> None:
    clock = (
        '<Clock name="tick" valueReference="999" causality="input" intervalVariability="triggered"/></ModelVariables>'
    )
    path = described(exported(tmp_path), lambda text: text.replace("</ModelVariables>", clock))
    with pytest.raises(UsageError, match="the clock 'tick': FMUs with clocks are not simulated"):
        FmuPlant(path, [], trusted=True)


def test_another_platform_is_named(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "x.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.format(name="x"))
        archive.writestr("binaries/win64/x.dll", "MZ")
    with pytest.raises(UsageError, match="binaries for win64: export it for this one, "):
        FmuPlant(tmp_path / "x.fmu", [], trusted=True)


def test_events_that_follow_on_each_other_end_the_simulation() -> None:
    watch: Any = SimpleNamespace(happened=lambda: None)
    progress = _Progress(watch, 0.1)
    for k in range(5 * MOST_EVENTS):  # many small steps are no fault
        assert progress(0.1 * k / (MOST_EVENTS - 1), None)
    assert all(progress(500.0, None) for _ in range(MOST_EVENTS + 1))
    with pytest.raises(ValueError, match=f"more than {MOST_EVENTS} steps or events at 500"):
        progress(500.0, None)
