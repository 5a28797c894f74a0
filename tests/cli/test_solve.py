"""``hil design`` and ``hil solve`` on the simulated rig: what is open, what is driven, and what is refused."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimator.physics.model import EffectValue
from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.orders.runner import predict
from hil.simulator.driveline import DEFAULT_BUS
from tests.cli.bus_model import MODEL
from tests.cli.conftest import Simulation
from tests.rig.serving import EXAMPLE

LAG = {"time_constant_s": 0.003, "shape": 0.0, "before_nm": 0.0}


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "bus.toml"
    path.write_text(MODEL, encoding="utf-8")
    return path


def recording(folder: Path, noise_rad_s: float, rows: int = 3000) -> Path:
    """Write a cruise of the default bus with a lag of 3 ms: by this noise a delay is as good."""
    true = replace(DEFAULT_BUS, effects={"actuator_lag": {key: EffectValue(value) for key, value in LAG.items()}})
    driven = predict(read_rig(EXAMPLE), "cruise", true)
    speed = driven.course_rad_s + noise_rad_s * np.random.default_rng(1).standard_normal(driven.course_rad_s.size)
    columns = np.column_stack([0.01 * np.arange(speed.size), driven.each_nm, speed])[:rows]
    path = folder / "cruise.csv"
    np.savetxt(path, columns, "%.7g", ",", header="time_s,torque_m1_nm,torque_m2_nm,speed_rad_s", comments="")
    return path


def design(folder: Path, model: Path, rec: Path, *options: str) -> int:
    command = ["design", str(rec), "--model", str(model), "--rig", str(EXAMPLE), "--out", str(folder / "next.toml")]
    return run([*command, "--effort", "quick", "--json", *options])


@pytest.mark.campaign
def test_a_lag_or_a_delay_is_open_and_the_design_says_what_would_tell(
    tmp_path: Path, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert design(tmp_path, model, recording(tmp_path, 0.3)) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["schema"] == "hil.design/1"
    open_effects = {name for each in said["hypotheses"] for name in each["effects"]}
    assert "transport_delay" in open_effects
    assert {"actuator_lag", "speed_filter"} & open_effects
    assert said["expected"]["factor"] >= 1.0
    assert (tmp_path / "next.toml").exists() is said["worth_driving"]


@pytest.mark.campaign
def test_the_test_for_the_parameters_is_one_that_the_rig_drives(
    tmp_path: Path, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert design(tmp_path, model, recording(tmp_path, 0.05, 1000), "--for", "parameters") == 0
    said = json.loads(capsys.readouterr().out)
    wide = {each["name"]: each["after"] / each["now"] for each in said["expected"]["intervals"]}
    assert wide["J_L"] < 0.5
    (table,) = tomllib.loads((tmp_path / "next.toml").read_text(encoding="utf-8"))["experiments"].values()
    wanted = said["experiment"]["table"]
    assert (table["kind"], set(table)) == (wanted["kind"], set(wanted))
    assert table["duration_s"] == pytest.approx(wanted["duration_s"], rel=1e-5)
    assert (tmp_path / "next.png").read_bytes().startswith(b"\x89PNG")
    assert run(["run", str(EXAMPLE), str(tmp_path / "next.toml"), "--dry-run"]) == 0


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("period_s = 0.01", "period_s = 0.02", "a period of 0.01 s, expected 0.02 s"),
        ("[experiments.", "[unknown.", "unknown"),
    ],
)
def test_recordings_of_another_rig_are_refused_by_name(
    tmp_path: Path, model: Path, capsys: pytest.CaptureFixture[str], before: str, after: str, message: str
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(EXAMPLE.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")
    rec = recording(tmp_path, 0.05, 1000)
    line = ["design", str(rec), "--model", str(model), "--rig", str(rig), "--out", str(tmp_path / "next.toml")]
    assert run(line) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "next.toml").exists()


def test_nothing_is_driven_without_someone_to_ask(
    tmp_path: Path, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "solved"
    assert run(["solve", str(EXAMPLE), "--model", str(model), "--out", str(out)]) == 2
    assert "commands torque" in capsys.readouterr().err
    assert not list(out.glob("**/*.parquet"))


def test_a_folder_of_another_model_is_refused_by_name(
    tmp_path: Path, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "solved"
    out.mkdir()
    state = {"schema": "hil.solve/1", "rig_sha256": "0", "model_sha256": "0", "driven": [], "end": None}
    (out / "solve.json").write_text(json.dumps(state), encoding="utf-8")
    assert run(["solve", str(EXAMPLE), "--model", str(model), "--out", str(out), "--yes"]) == 2
    assert "started with another rig file" in capsys.readouterr().err
    (out / "solve.json").write_text("{", encoding="utf-8")
    assert run(["solve", str(EXAMPLE), "--model", str(model), "--out", str(out), "--yes"]) == 2
    assert "Move it away" in capsys.readouterr().err


@pytest.mark.campaign
def test_what_the_first_experiment_does_not_show_is_found_by_the_designed_one(
    tmp_path: Path, model: Path, simulate: Callable[..., Simulation]
) -> None:
    """Dry friction: a cruise does not show it. The next call has nothing to do."""
    rig, out = simulate(EXAMPLE, "--effect", "coulomb_friction_motor:friction_nm=15"), tmp_path / "solved"
    line = ["solve", str(EXAMPLE), "--model", str(model), "--out", str(out), "--pace", "fast", "--yes"]
    assert run([*line, "--effort", "quick", *rig.addresses]) == 0
    state = json.loads((out / "solve.json").read_text(encoding="utf-8"))
    assert state["end"] == "decided"
    assert state["driven"][0]["name"] == "cruise"
    assert len(state["driven"]) <= 3
    found = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    assert [each["name"] for each in found["effects"]] == ["coulomb_friction_motor"]
    assert run([*line, *rig.addresses]) == 0
    assert json.loads((out / "solve.json").read_text(encoding="utf-8")) == state
