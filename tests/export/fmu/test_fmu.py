"""The exported FMU against the simulation of hil: every law, both standards.

FMPy (Dassault Systèmes, BSD) checks the archives and runs them.
"""

import functools
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from estimator.physics.catalogue import BUILT_IN
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.layout import Grid, flat_values
from estimator.physics.model import DrivelineModel, EffectValue, Parameter, Structure
from estimator.physics.simulate import motor_angle, simulate
from estimator.physics.tables import Table
from estimator.signals.record import FloatArray, Record
from hil.export.fmu.driveline import OF_THE_RECORDER, Driveline, driveline, started, variables
from hil.export.fmu.package import write
from tests.chosen import campaign, one_in
from tests.estimator.physics.bench import ONE_MASS, THREE_MASS, TWO_MASS, random_steps, record
from tests.estimator.physics.test_recovery import PLANTS, effect_of
from tests.estimator.physics.test_side_by_side import EVERYWHERE, ON_THE_SHAFT

PERIOD_S, SAMPLES, SIGN_WIDTH = 0.01, 300, 0.05
START = InitialCondition(12.0, 0.0, 5.0, 0.01, 4.0, 0.004, 4.5)
AGREES = 1e-6
"""Of the output's range: the issue's figure. What there is comes to 1e-10 and less."""

NEVER_REACHED = 1e30
"""Stands for a limit at infinity, which modelDescription.xml does not hold."""

Effects = Mapping[str, Mapping[str, float]]
LINES = {Structure.ONE_MASS: ONE_MASS, Structure.TWO_MASS: TWO_MASS, Structure.THREE_MASS: THREE_MASS}
IN_THE_LINE = [name for name in BUILT_IN if name not in OF_THE_RECORDER]


def planted(case: str) -> Effects:
    plant = PLANTS[case]
    own = {name: min(value, 1.7) if name == "to_s" else min(value, 0.9) for name, value in plant.own[0].items()}
    return {effect_of(case): {**plant.shared, **own}}


CASES: dict[str, Effects] = {
    **{case: planted(case) for case in PLANTS if effect_of(case) in IN_THE_LINE},
    **{case: effects for case, effects in (ON_THE_SHAFT | EVERYWHERE).items() if "clock_drift" not in effects},
    "quantised": {"speed_quantisation": {"step_rad_s": 0.25}},
    "late by parts of a step, heated": {
        "transport_delay": {"delay_s": 0.0237, "before_nm": 20.0},
        "actuator_lag": {"time_constant_s": 0.004, "shape": 0.4, "before_nm": -5.0},
        "torque_derating": {"depth": 0.3, "time_constant_s": 2.0, "heating_nm": 80.0, "warm": 0.4},
    },
    "warm when it starts": {
        "torque_derating": {"depth": 0.3, "time_constant_s": 2.0, "warm": 0.4},
        "warming_friction": {"cold_nm_s": 25.0, "time_constant_s": 0.7, "warm": 0.3},
    },
    "a mode before the shaft": {
        "extra_torsional_mode": {"frequency_hz": 1.0, "between_kg_m2": 0.2, "line_share": 0.8, "damping_ratio": 0.05}
    },
    "a mode behind the shaft": {
        "extra_torsional_mode": {"frequency_hz": 1.0, "behind_kg_m2": 0.9, "line_share": 0.7, "damping_ratio": 0.05}
    },
}
ONE_MASS_TOO = (
    "drag",
    "Stribeck",
    "drag and bristles",
    "drag and a brake that sticks",
    "warming",
    "ripple",
    "quantised",
)


def model(structure: Structure, effects: Effects) -> DrivelineModel:
    parameters = {name: Parameter(value, 0.2) for name, value in LINES[structure].items()}
    with_values = {name: {key: EffectValue(v) for key, v in e.items()} for name, e in effects.items()}
    return DrivelineModel(structure, parameters, effects=with_values)


def recording() -> Record:
    torque = np.column_stack([random_steps(SAMPLES, seed=3), random_steps(SAMPLES, seed=4, size_nm=40.0, hold=7)])
    time_s = np.arange(SAMPLES) * PERIOD_S
    return record(torque, 8.0 * np.sin(2.0 * np.pi * 0.4 * time_s))


@functools.cache
def everything(structure: Structure) -> Path:
    """Return an FMU of a line that has every effect, none of which acts: built once for all cases."""
    null = {name: {p.name: p.null for p in BUILT_IN[name].parameters} for name in IN_THE_LINE}
    p = np.nan_to_num(flat_values(LINES[structure], null), posinf=NEVER_REACHED)
    line = replace(driveline("everything", model(structure, {}), PERIOD_S), effects=tuple(IN_THE_LINE), p=p)
    path = Path(mkdtemp()) / "everything.fmu"
    write(line, "2.0", path)
    return path


def begun(structure: Structure, effects: Effects) -> tuple[Driveline, FloatArray, FloatArray]:
    """Return a line with some effects, its load torque, and its output as hil simulates it."""
    rec = recording()
    case = Case(flat_values(LINES[structure], effects), START, random_steps(SAMPLES, seed=8, size_nm=30.0, hold=25))
    grid = Grid(structure, 5, SIGN_WIDTH)
    line, load = started(driveline("line", model(structure, effects), PERIOD_S), grid, case, rec)
    expected = simulate(grid, rec, case.p, case.start, case.extra_load_nm)
    return replace(line, angle_is_read=True), load, expected


def inputs(names: set[str], load: FloatArray) -> np.ndarray:
    """Return what FMPy takes as input, a row per sample."""
    rec = recording()
    columns = {"time": rec.time_s, "T_M1": rec.torque_nm[:, 0], "T_M2": rec.torque_nm[:, 1], "T_load": load}
    if "angle_read" in names:
        angle = motor_angle(rec)
        columns["angle_read"] = angle
        columns["turn_rate"] = np.append(np.diff(angle), angle[-1] - angle[-2]) / PERIOD_S
    return np.array(list(zip(*columns.values(), strict=True)), dtype=[(name, float) for name in columns])


def simulated(fmu: Path, line: Driveline, load: FloatArray) -> FloatArray:
    """Return the measured speed that an FMU gives."""
    names = {each.name for each in read_model_description(fmu).modelVariables}
    given = inputs(names, load)
    start = {each.name: each.start for each in variables(line) if each.causality == "parameter" and each.name in names}
    if "angle_is_read" in names:
        start["angle_is_read"] = True
    end_s = (SAMPLES - 1) * PERIOD_S
    result = simulate_fmu(
        fmu, fmi_type="CoSimulation", start_values=start, input=given, stop_time=end_s, output_interval=PERIOD_S,
        output=["speed_measured"],
    )  # fmt: skip
    return np.interp(given["time"], result["time"], result["speed_measured"])


def off(actual: FloatArray, expected: FloatArray) -> float:
    """Return the largest difference over the range of what was expected."""
    return float(np.abs(actual - expected).max() / np.ptp(expected))


@pytest.mark.parametrize(
    ("structure", "case"),
    [(Structure.TWO_MASS, case) for case in CASES] + one_in(5, [(Structure.ONE_MASS, case) for case in ONE_MASS_TOO])
    + one_in(5, [(Structure.THREE_MASS, case) for case in ON_THE_SHAFT]),
)  # fmt: skip
def test_the_steps_are_those_of_hil(structure: Structure, case: str) -> None:
    line, load, expected = begun(structure, CASES[case])
    assert off(simulated(everything(structure), line, load), expected) < AGREES


def test_every_effect_that_acts_in_the_line_is_exported() -> None:
    assert {name for effects in CASES.values() for name in effects} == set(IN_THE_LINE) - {"road_grade"}


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize(
    "structure", [Structure.TWO_MASS, campaign(Structure.ONE_MASS), campaign(Structure.THREE_MASS)]
)
def test_the_standards_checker_finds_nothing(version: str, structure: Structure, tmp_path: Path) -> None:
    line, load, expected = begun(structure, {"coulomb_friction_motor": {"friction_nm": 5.0}})
    write(line, version, tmp_path / "line.fmu")
    assert validate_fmu(str(tmp_path / "line.fmu")) == []
    assert off(simulated(tmp_path / "line.fmu", line, load), expected) < AGREES


CURVES = [
    Table("torque", (-100.0, -20.0, 0.0, 30.0, 100.0), (9.0, 0.0, 0.0, -2.0, -14.0)),
    Table("motor_speed", (-8.0, -1.0, 0.0, 2.0, 8.0), (-6.0, -3.0, 0.0, 2.0, 5.0)),
    Table("shaft_twist", (-0.02, -0.01, 0.0, 0.01, 0.02), (30.0, 35.0, 0.0, -35.0, 20.0), damping=1.5),
    Table("shaft_rate", (-3.0, 0.0, 3.0), (-9.0, 0.0, 4.0)),
    Table("load_speed", (-8.0, 0.0, 1.0, 8.0), (-9.0, 0.0, 4.0, 6.0)),
    Table("load_angle", (0.0, 1.0, 2.0, 3.0), (0.0, 12.0, -9.0, 0.0)),
]


@pytest.mark.parametrize("curves", [CURVES, CURVES[2:3]], ids=["all", "twist"])
def test_a_law_without_a_name_is_exported_to_rounding(curves: list[Table], tmp_path: Path) -> None:
    effects = {each.name: {key: value.value for key, value in each.effect().items()} for each in curves}
    line, load, expected = begun(Structure.TWO_MASS, effects)
    write(line, "2.0", tmp_path / "line.fmu")
    assert off(simulated(tmp_path / "line.fmu", line, load), expected) < 1e-9
    assert off(begun(Structure.TWO_MASS, {})[2], expected) > 0.01
