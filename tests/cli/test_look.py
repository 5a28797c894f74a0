"""hil look and hil model new: from a file that nobody has described to one that every command reads."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from estimator.physics.model import Parameter
from hil.cli.main import run
from hil.config.model_file import read_model, read_model_for_recordings
from hil.recording import read_record
from tests.cli import bench

ROWS = 300
TIME = np.arange(ROWS) * 0.01
VALUES = [f"--value={text}" for text in ("J_M=1.7", "J_L=95", "k=4500", "c=8", "b_M=0.3", "b_L=1")]


def rows(delimiter: str, *columns: np.ndarray) -> list[str]:
    return [delimiter.join(f"{cell:.3f}" for cell in row) for row in zip(*columns, strict=True)]


@pytest.fixture
def german(tmp_path: Path) -> Path:
    """As Excel writes it in Germany, in its own encoding."""
    text = rows(";", TIME, 80.0 * np.sin(9 * TIME), 70.0 * np.sin(9 * TIME), 900.0 + 20.0 * np.cos(9 * TIME), TIME)
    head = "Zeit [s];Drehmoment M1 [Nm];Drehmoment M2 [Nm];Drehzahl [1/min];Öltemperatur [°C]"
    (tmp_path / "fahrt.csv").write_bytes("\r\n".join([head, *text]).replace(".", ",").encode("latin-1"))
    return tmp_path / "fahrt.csv"


def test_what_look_prints_is_all_it_takes_to_read_the_file(
    german: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["look", str(german)]) == 0
    shown = capsys.readouterr().out
    assert "a semicolon between cells, decimal comma" in shown
    assert "every 0.01 s" in shown
    table = shown[shown.index("[signals]") :]
    assert run(["model", "new", str(tmp_path / "bare.toml"), "--yes", *VALUES]) == 0
    (tmp_path / "bus.toml").write_text((tmp_path / "bare.toml").read_text() + "\n" + table)
    record = read_record(german, read_model_for_recordings(tmp_path / "bus.toml").signals)
    assert record.torque_nm.shape == (ROWS, 2)
    assert record.output[0] == pytest.approx(920.0 * 2.0 * np.pi / 60.0)


def contract(path: Path, *more: str) -> None:
    head = "time_s,torque_m1_nm,torque_m2_nm,speed_rad_s"
    path.write_text("\n".join([head, *more, *rows(",", TIME, TIME, TIME**2, 3.0 * TIME)]))


def unnamed(path: Path) -> None:
    path.write_text("\n".join(rows(",", TIME, TIME**2, 3.0 * TIME)))


def epoch_ms(path: Path) -> None:
    stamps = [f"{1.77e12 + 1e3 * t:.0f},{t:.3f},{2 * t:.3f}" for t in TIME.tolist()]
    path.write_text("\n".join(["timestamp,u,w", *stamps]))


def no_time(path: Path) -> None:
    path.write_text("\n".join(["u,w", *rows(",", np.sin(TIME), np.cos(TIME))]))


def per_cent(path: Path) -> None:
    path.write_text("\n".join(["t,torque,speed", "s,%,rpm", *rows(",", TIME, np.sin(TIME), np.cos(TIME))]))


def uneven(path: Path) -> None:
    stamps = np.cumsum(np.random.default_rng(1).uniform(0.004, 0.016, ROWS))
    path.write_text("\n".join(["t,u,w", *rows(",", stamps, np.sin(TIME), np.cos(TIME))]))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (contract, "no [signals] table is needed"),
        (unnamed, "# torque = [ { column = ... } ]"),
        (epoch_ms, 'time = { column = "timestamp", scale = 1e-3 }'),
        (no_time, "# time = { sample_time_s = ... }   # no channel is a time: write the true period"),
        (per_cent, "in %: give scale = rated value * 0.01"),
        (uneven, "resample_s = 0.01   # rows are uneven"),
    ],
)
def test_what_can_t_be_reported_is_left_to_a_person(
    make: Callable[[Path], None], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make(tmp_path / "run.csv")
    assert run(["look", str(tmp_path / "run.csv")]) == 0
    assert said in capsys.readouterr().out


def identification(path: Path) -> None:
    def one(value: float, half: float, determined: bool) -> dict[str, object]:
        return {"value": value, "std": half / 2, "ci95": [value - half, value + half], "determined": determined}

    recordings = [
        {"name": "a", "J_M": one(1.6, 0.5, True), "b_M": one(0.4, 0.1, True)},
        {"name": "b", "J_M": one(1.5, 0.3, True), "b_M": one(9.0, 0.01, False)},
    ]
    document = {
        "schema": "hil.identification/1",
        "settings": {"na": 4, "nb": 4, "nk": 1, "sample_time_s": 0.02, "high_pass_hz": 0.3},
        "recordings": [
            {"name": r["name"], "output": "speed", "filter_L": [1.0], "physical": {"parameters": {**r}}}
            for r in recordings
        ],
    }
    path.write_text(json.dumps(document))


def test_an_identification_gives_values_with_their_intervals(tmp_path: Path) -> None:
    identification(tmp_path / "identification.json")
    source = ["--from", str(tmp_path / "identification.json"), "--structure", "one_mass", "--yes"]
    assert run(["model", "new", str(tmp_path / "surest.toml"), *source]) == 0
    surest = read_model(tmp_path / "surest.toml").model.parameters
    assert surest == {"J_M": Parameter(1.5, ci95=(1.2, 1.8)), "b_M": Parameter(0.4, ci95=(0.3, 0.5))}
    assert "identified from b" in (tmp_path / "surest.toml").read_text()
    assert run(["model", "new", str(tmp_path / "a.toml"), *source, "--run", "a", "--value", "b_M=0.1"]) == 0
    of_a = read_model(tmp_path / "a.toml").model.parameters
    assert of_a == {"J_M": Parameter(1.6, ci95=(1.1, 2.1)), "b_M": Parameter(0.1, 0.2)}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--structure", "five_mass"], "--structure five_mass | expected one of one_mass"),
        (["--value", "J_X=1"], "--value J_X=1 | expected NAME=NUMBER with a name of two_mass"),
        (["--value", "J_M=heavy"], "--value J_M=heavy | expected NAME=NUMBER"),
        (["--tolerance", "wide"], "--tolerance wide | expected a number, or NAME=NUMBER"),
        (["--value", "J_M=1"], "--value J_L=NUMBER | expected inertia of the load"),
        ([*VALUES, "--value", "k=-5"], "parameters.k"),
        ([*VALUES, "--value", "b_M=0"], "expected --tolerance b_M=0 next to it"),
        (["--from", "gone.json"], "gone.json"),
        (["--recording", "gone.csv"], "gone.csv"),
    ],
)
def test_what_makes_no_model_is_refused_and_nothing_is_written(
    options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["model", "new", str(tmp_path / "m.toml"), "--yes", *options]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_plot_is_a_page_in_this_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    rows = [f"{0.01 * k:.2f},{k % 7},{k % 11},{'' if k == 50 else k % 13}" for k in range(100)]
    (tmp_path / "sub" / "run.csv").write_text("\n".join(["time_s,torque_m1_nm,torque_m2_nm,speed_rad_s", *rows]))
    assert run(["look", "sub/run.csv", "--plot"]) == 0
    assert "page: run.look.html" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["run.look.html"]
    page = (tmp_path / "run.look.html").read_text()
    assert 'data-cut="channels-0"' in page


Columns = dict[str, np.ndarray]


def recorded(path: Path) -> Columns:
    """Return the columns of a drive whose inverters share the torque unequally."""
    bench.record(path, 1, noise=0.02, n=3000)
    time, first, second, speed = np.loadtxt(path, delimiter=",", skiprows=1).T
    share = np.where(np.sin(0.4 * time) > 0.0, 0.4, -0.4) * (first + second)
    return {"t": time, "T_1": first + share, "T_2": second - share, "w": speed}


def one_turned(columns: Columns) -> Columns:
    return {**columns, "T_2": -columns["T_2"]}


def output_turned(columns: Columns) -> Columns:
    return {**columns, "w": -columns["w"]}


def in_rpm(columns: Columns) -> Columns:
    return {**columns, "w": columns["w"] * 200.0 * 30.0 / np.pi, "T_1": columns["T_1"] * 200.0}


def per_mille(columns: Columns) -> Columns:
    return {**columns, "T_1": np.round(columns["T_1"] * 5.0), "T_2": np.round(columns["T_2"] * 5.0)}


def with_contracts_names(columns: Columns, time: np.ndarray) -> Columns:
    """Return columns that need no table, at another time."""
    names = ("torque_m1_nm", "torque_m2_nm", "speed_rad_s")
    return {"time_s": time} | dict(zip(names, list(columns.values())[1:], strict=True))


def in_ms(columns: Columns) -> Columns:
    return with_contracts_names(columns, 1e3 * columns["t"])


def in_days(columns: Columns) -> Columns:
    return with_contracts_names(columns, 45_000.0 + columns["t"] / 86_400.0)


def one_dead(columns: Columns) -> Columns:
    return with_contracts_names({**columns, "T_2": 0.0 * columns["T_2"]}, columns["t"])


def looked(tmp_path: Path, columns: Columns, capsys: pytest.CaptureFixture[str]) -> tuple[Path, str, str]:
    path = tmp_path / "drive.csv"
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")
    assert run(["look", str(path)]) == 0
    said = capsys.readouterr()
    return path, said.out, said.err


@pytest.mark.parametrize(
    ("spoilt", "what", "line"),
    [
        (
            one_turned,
            "sign of torque input 2 (T_2) turned round",
            'torque = [ { column = "T_1" }, { column = "T_2", scale = -1 } ]',
        ),
        (output_turned, "sign of torque or output turned round", 'speed = { column = "w", scale = -1, at = "motor" }'),
        (in_rpm, "is the speed in rpm, expected rad/s?", 'speed = { column = "w", scale = 0.10472, at = "motor" }'),
        (in_ms, "Is time in ms, expected s?", 'time = { column = "time_s", scale = 0.001 }'),
        (in_days, "Is time in days, expected s?", 'time = { column = "time_s", scale = 86400 }'),
        (one_dead, "torque input 2 stays at 0", "if the channel is dead"),
        (per_mille, "per mille of the rated torque", 'torque = [ { column = "T_1", scale = 0.001 }, '),
    ],
)
def test_what_is_wrong_is_named_with_the_line_that_cures_it(
    spoilt: Callable[[Columns], Columns], what: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, _, err = looked(tmp_path, spoilt(recorded(tmp_path / "run.csv")), capsys)
    assert what in err
    assert line in err


def test_rows_at_two_rates_are_uneven(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    columns = recorded(tmp_path / "run.csv")
    half = columns["t"][columns["t"].size // 2]
    slower = np.where(columns["t"] < half, columns["t"], half + 1.3 * (columns["t"] - half))
    _, out, err = looked(tmp_path, {**columns, "t": slower}, capsys)
    assert "resample_s = " in out
    assert "can't be read yet" not in err
