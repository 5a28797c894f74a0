"""``hil export st`` and ``hil export plcopen`` on real files: what they write, what they refuse."""

import json
import zipfile
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

from estimator.identification.settings import Settings
from estimator.signals.record import Record
from hil.cli.main import run
from hil.export.plc_estimator import PlcEstimator
from hil.export.plcopen import Tc6, plcopen_xml
from hil.export.structured_text import Precision, structured_text
from hil.recording import read_table
from hil.report.identification_json import identification_text
from tests.cli import bench

BOTH = pytest.mark.parametrize("what", ["st", "plcopen"])

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "estimator.st"


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from estimator.identification.identify import identify
    from tests.estimator.identification.driveline import cruise

    records: list[Record] = [cruise(seed, duration_s=15.0, name=f"run_{seed}").record for seed in (1, 2)]
    settings = Settings()
    path = tmp_path_factory.mktemp("identified") / "identification.json"
    text = identification_text([identify(record, settings) for record in records], settings, None)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("option", "precision"), [((), Precision.DOUBLE), (("--single",), Precision.SINGLE)])
def test_the_filter_and_the_settings_are_those_of_the_run(
    identified: Path, tmp_path: Path, option: tuple[str, ...], precision: Precision
) -> None:
    out = tmp_path / "new" / "estimator.st"
    assert run(["export", "st", str(identified), "--run", "run_2", "--out", str(out), *option]) == 0
    L = json.loads(identified.read_text())["recordings"][1]["filter_L"]
    expected = PlcEstimator(Settings(), 0.01, np.array(L), "identification.json, recording run_2")
    assert out.read_text(encoding="ascii") == structured_text(expected, precision)


@pytest.mark.parametrize(
    ("options", "precision", "version"),
    [
        ((), Precision.DOUBLE, Tc6.V2_01),
        (("--single",), Precision.SINGLE, Tc6.V2_01),
        (("--tc6", "2.0"), Precision.DOUBLE, Tc6.V2_0),
    ],
)
def test_plcopen_has_the_same_content(
    identified: Path, tmp_path: Path, options: tuple[str, ...], precision: Precision, version: Tc6
) -> None:
    out = tmp_path / "estimator.xml"
    assert run(["export", "plcopen", str(identified), "--run", "run_2", "--out", str(out), *options]) == 0
    text = out.read_text(encoding="ascii")
    L = json.loads(identified.read_text())["recordings"][1]["filter_L"]
    estimator = PlcEstimator(Settings(), 0.01, np.array(L), "identification.json, recording run_2")
    written = datetime.fromisoformat(text.partition('creationDateTime="')[2].partition('"')[0])
    assert text == plcopen_xml(estimator, written, precision, version)


def test_the_example_is_what_the_command_writes_today(tmp_path: Path) -> None:
    out = tmp_path / "estimator.st"
    assert run(["export", "st", "--adaptive", "--out", str(out)]) == 0
    assert EXAMPLE.read_text(encoding="ascii") == out.read_text(encoding="ascii"), (
        "bring it up to date by: hil export st --adaptive --out examples/estimator.st"
    )


@BOTH
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["FILE", "--run", "run_3"], "run_1, run_2"),
        (["FILE"], "named by --run: run_1, run_2"),
        (["FILE", "--run", "run_1", "--cycle", "0.003"], "0.02 s"),
        (["FILE", "--run", "run_1", "--profile", "wild"], "decreasing_gain"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda1=x"], "lambda1=number"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda=1"], "lambda1, initial_gain"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda1=2"], "at most 1"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda1=1,lambda1=1"], "at most once"),
        (["FILE", "--run", "run_1", "--cycle", "0"], "whole fraction"),
        (["FILE", "--run", "run_1", "--cycle", "nan"], "whole fraction"),
        (["FILE", "--run", "run_1", "--cycle", "1e-9"], "low-pass has 320000001 elements, expected fewer than 32767"),
        (["FILE", "--run", "run_1", "--single", "--profile", "constant_gain:initial_gain=1e60"], "REAL has no number"),
        (["FILE", "--run", "run_1", "--single", "--profile", "constant_gain:initial_gain=1e-60"], "REAL has no number"),
        (["missing.json"], "missing.json: the file | expected identification.json | got: No such file"),
        ([], "--adaptive"),
        (["--adaptive", "--run", "run_1"], "got no file"),
    ],
)
def test_wrong_use_is_refused(
    what: str, identified: Path, tmp_path: Path, arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [str(identified) if word == "FILE" else word for word in arguments]
    assert run(["export", what, *given, "--out", str(tmp_path / "estimator")]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@BOTH
@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "line 1 | expected JSON"),
        (b"[]", "a JSON object"),
        (b"\xff\xfe", "UTF-8"),
        (b"{}", "schema | expected this key"),
        (b'{"schema": "hil.diagnosis/1"}', "schema | expected 'hil.identification/1'"),
    ],
)
def test_a_wrong_file_is_refused_by_place(
    what: str, content: bytes, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "identification.json", tmp_path / "estimator"
    path.write_bytes(content)
    assert run(["export", what, str(path), "--out", str(out)]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


def _changed(identified: Path, folder: Path, part: str, **changes: object) -> Path:
    document = json.loads(identified.read_text())
    target = document["settings"] if part == "settings" else document["recordings"][0]
    target.update(changes)
    path = folder / "identification.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


@BOTH
@pytest.mark.parametrize(
    ("part", "changes", "said"),
    [
        ("recording", {"output": "position"}, "expected 'speed'"),
        ("recording", {"filter_L": [1.0, -1.2]}, "recordings.run_1.filter_L | oefo: L has a root of magnitude 1.2"),
        ("recording", {"filter_L": [1.0, float("nan")]}, "recordings.run_1.filter_L | oefo: L is"),
        ("recording", {"filter_L": [2.0, 0.5]}, "recordings.run_1.filter_L | oefo: L is"),
        ("recording", {"filter_L": []}, "recordings.0.filter_L"),
        ("recording", {"filter_L": ["1"]}, "recordings.0.filter_L.0"),
        ("recording", {"filter_L": [1.0] + [0.0] * 40000}, "memory has 40001 elements"),
        ("settings", {"na": -1}, "identification.json: settings | model orders: na is -1"),
        ("settings", {"nb": 0}, "identification.json: settings | model orders: nb is 0"),
        ("settings", {"na": "4"}, "settings.na | expected a valid integer"),
        ("settings", {"na": 400, "nb": 400}, "gain F has 640000 elements"),
        ("settings", {"nk": 40000}, "memory has 40004 elements"),
        ("settings", {"sample_time_s": 0.0}, "identification.json: settings | identification: sample_time_s is 0.0"),
        ("settings", {"high_pass_hz": 100.0}, "below 25 Hz"),
    ],
)
def test_a_model_that_can_not_serve_is_refused(
    what: str,
    identified: Path,
    tmp_path: Path,
    part: str,
    changes: dict[str, object],
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, out = _changed(identified, tmp_path, part, **changes), tmp_path / "estimator"
    assert run(["export", what, str(path), "--run", "run_1", "--out", str(out)]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


@BOTH
def test_a_filter_that_rounding_makes_unstable_is_refused(
    what: str, identified: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = _changed(identified, tmp_path, "recording", filter_L=[1.0, -0.99999999])
    arguments = ["export", what, str(path), "--run", "run_1", "--out"]
    assert run([*arguments, str(tmp_path / "double")]) == 0
    assert run([*arguments, str(tmp_path / "single"), "--single"]) == 2
    assert "rounded to REAL, oefo: L has a root of magnitude 1" in capsys.readouterr().err
    assert not (tmp_path / "single").exists()


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


def test_the_usual_step_is_as_given_or_that_of_the_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run_1.csv"
    bench.record(path, 1, noise=0.05)
    header, *rows = path.read_text().splitlines(keepends=True)
    path.write_text("".join([header, *rows[::2]]))
    recording = ["--recording", str(path)]
    for more, step_s in (([], bench.DT), (["--period", "0.004"], 0.004), (recording, 2.0 * bench.DT)):
        fmu = read_model_description(exported(tmp_path, "--sources-only", *more), validate=False)
        assert float(fmu.defaultExperiment.stepSize) == pytest.approx(step_s)
        (longest,) = (float(each.start) for each in fmu.modelVariables if each.name == "step_s")
        assert step_s / longest == pytest.approx(round(step_s / longest))  # whole steps of integration in each
    command = ["export", "fmu", str(tmp_path / "drive.toml"), "--out", str(tmp_path / "again.fmu"), *recording]
    assert run([*command, "--period", "0.004"]) == 2
    assert "got --period with --recording" in capsys.readouterr().err
    assert not (tmp_path / "again.fmu").exists()


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
