"""A user's own law through the commands: named in the model file, believed or rejected, written and simulated again."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run
from tests.cli import bench

PEAK_NM, PEAK_RAD_S = 3.0, 2.0

LAWS = """
def drag(time_s, motor_speed, load_speed, twist, torque, peak_nm, peak_rad_s):
    ratio = motor_speed / peak_rad_s
    return 2.0 * peak_nm * ratio * abs(ratio) / (1.0 + abs(ratio) ** 3)

def narrow(motor_speed):
    return 0.0

def undefined(time_s, motor_speed, load_speed, twist, torque, peak_nm, peak_rad_s):
    return peak_nm * float("nan")

number = 3
"""

LAW = """
[laws.retarder]
function = "%s"
element = "motor"
[laws.retarder.parameters]
peak_nm    = { unit = "Nm", low = 0.0, high = 50.0, start = 1.0 }
peak_rad_s = { unit = "rad/s", low = 0.2, high = 20.0, start = 5.0 }
"""


def retarded(path: Path, seed: int) -> None:
    """Write a recording of the bench's drive with a retarder on it, by a fine midpoint rule."""
    bench.record(path, seed, n=900)
    table = np.genfromtxt(path, delimiter=",", names=True)
    torque = table["torque_m1_nm"] + table["torque_m2_nm"]
    speed, w, h = np.empty_like(torque), 1.0, bench.DT / bench.SUBSTEPS

    def rate(w: float, given: float) -> float:
        ratio = w / PEAK_RAD_S
        drag = 2.0 * PEAK_NM * ratio * abs(ratio) / (1.0 + abs(ratio) ** 3)
        return (given - bench.LOAD - bench.B * w - drag) / bench.J

    for k, given in enumerate(torque):
        speed[k] = w
        for _ in range(bench.SUBSTEPS):
            w += h * rate(w + 0.5 * h * rate(w, given), given)
    speed += 0.02 * np.random.default_rng(seed).standard_normal(speed.size)
    columns = [table["time_s"], table["torque_m1_nm"], table["torque_m2_nm"], speed]
    np.savetxt(
        path,
        np.column_stack(columns),
        delimiter=",",
        header="time_s,torque_m1_nm,torque_m2_nm,speed_rad_s",
        comments="",
        fmt="%.12g",
    )


@pytest.fixture
def model(tmp_path: Path) -> Path:
    (tmp_path / "given").mkdir()
    (tmp_path / "given" / "my_own_laws.py").write_text(LAWS)
    return bench.model(tmp_path / "given" / "drive.toml", bench.MODEL + LAW % "my_own_laws:drag")


def test_it_is_found_written_and_simulated_again(model: Path, tmp_path: Path) -> None:
    names = [tmp_path / f"run_{i}.csv" for i in range(3)]
    for i, path in enumerate(names):
        retarded(path, i)
    out = tmp_path / "elsewhere" / "out"
    out.parent.mkdir()
    command = ["diagnose", str(names[0]), str(names[1]), "--model", str(model), "--trust-laws", "--out", str(out)]
    assert run([*command, "--holdout", str(names[2])]) == 0
    verdict = json.loads((out / "diagnosis.json").read_text())
    assert verdict["verdict"] == "explained"
    assert [effect["name"] for effect in verdict["effects"]] == ["retarder"]
    found = verdict["effects"][0]["parameters"]
    for name, true, unit in (("peak_nm", PEAK_NM, "Nm"), ("peak_rad_s", PEAK_RAD_S, "rad/s")):
        assert found[name]["value"] == pytest.approx(true, rel=0.03)
        assert found[name]["ci95"][0] < found[name]["value"] < found[name]["ci95"][1]
        assert found[name]["unit"] == unit

    simulated = tmp_path / "simulated.csv"
    augmented = str(out / "augmented.toml")
    assert (
        run(["simulate", "--trust-laws", "--model", augmented, "--input", str(names[2]), "--out", str(simulated)]) == 0
    )
    with simulated.open() as file:
        speed = np.array([float(row["speed_sim_rad_s"]) for row in csv.DictReader(file)])
    measured = np.genfromtxt(names[2], delimiter=",", names=True)["speed_rad_s"]
    assert float(np.sqrt(np.mean((speed - measured) ** 2))) < 0.022


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (LAW % "no_such_module:drag", "laws.retarder.function | expected module 'no_such_module'"),
        (LAW % "my_own_laws:nothing", "laws.retarder.function | expected a function 'nothing'"),
        (LAW % "my_own_laws:number", "got int"),
        (LAW % "my_own_laws:narrow", "laws.retarder.function my_own_laws:narrow: expected a function of (time_s,"),
        (LAW % "my_own_laws:undefined", "expected a finite number, got nan"),
        (LAW % "my_own_laws", "laws.retarder.function"),
        ((LAW % "my_own_laws:drag").replace('"motor"', '"wheel"'), "laws.retarder.element"),
        ((LAW % "my_own_laws:drag").replace("low = 0.0,", ""), "laws.retarder.parameters.peak_nm.low"),
        ((LAW % "my_own_laws:drag").replace("retarder", "backlash"), "laws.backlash: expected a name that is not"),
        (LAW % "my_own_laws:drag" + "[effects.other]\nx = { value = 1 }\n", "effects.other: unknown effect"),
    ],
)
def test_a_law_that_can_not_be_used_is_refused(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    bench.model(model, bench.MODEL + text)
    recording = tmp_path / "run.csv"
    bench.record(recording, 1)
    out = tmp_path / "out.csv"
    assert run(["simulate", "--trust-laws", "--model", str(model), "--input", str(recording), "--out", str(out)]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not out.exists()
