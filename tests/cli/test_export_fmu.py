"""``hil export fmu`` from the command line: a recording simulated again, and clear refusals."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from hil.cli.main import run
from hil.recording import read_table
from tests.cli import bench

FRICTION = "\n[effects.coulomb_friction_motor]\nfriction_nm = { value = 1.5 }\n"


def exported(tmp_path: Path, *more: str, text: str = bench.MODEL + FRICTION) -> Path:
    (tmp_path / "drive.toml").write_text(text)
    assert run(["export", "fmu", str(tmp_path / "drive.toml"), "--out", str(tmp_path / "drive.fmu"), *more]) == 0
    return tmp_path / "drive.fmu"


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_recording_is_simulated_as_hil_does(version: str, tmp_path: Path) -> None:
    recording = tmp_path / "run_1.csv"
    bench.record(recording, 1, noise=0.05)
    fmu = exported(tmp_path, "--recording", str(recording), "--fmi", version)
    model, out = str(tmp_path / "drive.toml"), tmp_path / "simulated.csv"
    assert run(["simulate", "--model", model, "--input", str(recording), "--out", str(out)]) == 0
    table = read_table(recording).numeric(["time_s", "torque_m1_nm", "torque_m2_nm"])
    time_s = table["time_s"]
    given = np.array(
        list(zip(time_s, table["torque_m1_nm"], table["torque_m2_nm"], strict=True)),
        dtype=[("time", float), ("T_M1", float), ("T_M2", float)],
    )
    found = simulate_fmu(
        fmu, fmi_type="CoSimulation", input=given, stop_time=time_s[-1], output_interval=time_s[1] - time_s[0],
        output=["speed_measured"],
    )["speed_measured"]  # fmt: skip
    expected = read_table(out).numeric(["speed_sim_rad_s"])["speed_sim_rad_s"]
    assert np.abs(found - expected).max() < 1e-6


def test_without_a_compiler_it_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "drive.toml").write_text(bench.MODEL)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    command = ["export", "fmu", str(tmp_path / "drive.toml"), "--out", str(tmp_path / "drive.fmu")]
    assert run(command) == 2
    said = capsys.readouterr().err
    assert "C compiler" in said
    assert "--sources-only" in said
    assert not (tmp_path / "drive.fmu").exists()
    assert run([*command, "--sources-only"]) == 0
    names = zipfile.ZipFile(tmp_path / "drive.fmu").namelist()
    assert "sources/laws.h" in names
    assert not any(name.startswith("binaries") for name in names)


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        (bench.MODEL, "drive.zip", "a name that ends in .fmu"),
        ('schema = "hil.model/1"\nstructure = "joint"\n[parameters]\nk = { value = 1.0, tolerance = 0.1 }\n'
         "c = { value = 1.0, tolerance = 0.1 }\n", "drive.fmu", "got a joint"),
        (bench.MODEL + '\n[laws.drag]\nfunction = "mine:drag"\nelement = "motor"\nparameters = { size = { low = 0.0, '
         "high = 5.0, start = 1.0 } }\n[effects.drag]\nsize = { value = 1.0 }\n", "drive.fmu", "a law of your own"),
    ],
)  # fmt: skip
def test_what_can_not_be_exported_is_refused(
    text: str, name: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "drive.toml").write_text(text)
    assert run(["export", "fmu", str(tmp_path / "drive.toml"), "--out", str(tmp_path / name)]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / name).exists()
