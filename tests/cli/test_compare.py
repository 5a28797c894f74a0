"""``hil compare``: the figures are those of the noise, wrong input leaves nothing."""

import json
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run
from tests.cli import bench
from tests.report.conftest import figures

NOISE = 0.05


@pytest.fixture
def inputs(tmp_path: Path) -> list[str]:
    bench.record(tmp_path / "run_1.csv", 1, noise=NOISE)
    bench.record(tmp_path / "run_2.csv", 2, noise=2 * NOISE)
    return [str(bench.model(tmp_path / "drive.toml")), str(tmp_path / "run_1.csv"), str(tmp_path / "run_2.csv")]


def test_the_right_model_is_off_by_the_noise(inputs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", *inputs, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["schema"] == "hil.compare/1"
    for name, noise, truth in (("run_1", NOISE, 1), ("run_2", 2 * NOISE, 2)):
        figures = content["recordings"][name]
        assert figures["unit"] == "rad/s"
        assert figures["rms"] == pytest.approx(noise, rel=0.06)  # 3 sigma of a spread from 1500 samples
        assert 3 * noise < figures["largest"] < 6 * noise
        spread = np.std(bench.record(Path(inputs[truth]), truth, noise=noise))
        assert figures["fit_percent"] == pytest.approx(100 * (1 - noise / spread), abs=0.2)
        assert figures["load_torque"] == pytest.approx(bench.LOAD, abs=0.02)
        assert (figures["samples_used"], figures["samples"]) == (1500, 1500)


def test_a_time_in_days_is_refused_with_what_to_write(
    inputs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head, *rows = Path(inputs[1]).read_text().splitlines()
    days = [
        f"{739678.0 + float(first) / 86400.0:.12f},{rest}" for first, _, rest in (row.partition(",") for row in rows)
    ]
    Path(inputs[1]).write_text("\n".join([head, *days]) + "\n")
    assert run(["compare", *inputs[:2]]) == 2
    assert "time = { column = ..., scale = 86400.0 } reads days" in capsys.readouterr().err


def test_models_stand_side_by_side_as_they_are_given(inputs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    other = Path(inputs[0]).with_name("other.toml")
    other.write_text(Path(inputs[0]).read_text())
    assert run(["compare", inputs[0], str(other), inputs[1]]) == 0
    assert {"drive.toml", "other.toml"} <= set(capsys.readouterr().out.split())
    assert run(["compare", inputs[0], str(other)]) == 2
    assert "expected at least one model (.toml or .fmu) and one recording, got 2 and 0" in capsys.readouterr().err


def test_figures_and_plots_are_written(inputs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", *inputs, "--out", str(tmp_path / "result")]) == 0
    out = capsys.readouterr().out
    assert "run_1" in out
    assert "run_2" in out
    assert sorted(path.name for path in (tmp_path / "result").iterdir()) == ["compare.html", "compare.json"]
    page = (tmp_path / "result" / "compare.html").read_text()
    assert page.count('class="plotly-graph-div"') == 6
    assert "drive.toml against 2 recordings" in page


OUTPUTS = """
[signals]
outputs = [
    { kind = "speed", at = "motor", column = "speed_rad_s" },
    { kind = "position", at = "motor", column = "angle_rad" },
    { kind = "acceleration", at = "motor", column = "dead_rad_s2" },
]
"""


@pytest.fixture
def two_outputs(tmp_path: Path) -> list[str]:
    """A drive whose angle is read too, by an encoder with a zero of its own, and an accelerometer that is dead."""
    for seed in (1, 2):
        path = tmp_path / f"run_{seed}.csv"
        speed = bench.record(path, seed, noise=NOISE, n=600)
        angle = 5.0 + bench.angle(path, speed) + 0.01 * np.random.default_rng(seed).normal(size=speed.size)
        lines = path.read_text().splitlines()
        columns = ["angle_rad,dead_rad_s2", *(f"{each:.12g},0.25" for each in angle)]
        path.write_text("\n".join(f"{line},{more}" for line, more in zip(lines, columns, strict=True)) + "\n")
    model = bench.model(tmp_path / "drive.toml", bench.MODEL + OUTPUTS)
    return [str(model), str(tmp_path / "run_1.csv"), str(tmp_path / "run_2.csv")]


def test_each_output_has_its_figures(two_outputs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", *two_outputs, "--json"]) == 0
    said = capsys.readouterr()
    content = json.loads(said.out)
    for name in ("run_1", "run_2"):
        assert content["recordings"][name]["rms"] == pytest.approx(NOISE, rel=0.1)
        (figures,) = content["recordings"][name]["outputs"].values()
        assert figures["unit"] == "rad"
        assert figures["rms"] == pytest.approx(0.01, rel=0.2)  # its zero is no error
        assert figures["samples_used"] == 600
        assert 0.0 <= figures["residual"]["past_input_p_value"] <= 1.0
    together = content["models"]["drive.toml"]["outputs"]["angle_rad"]
    assert together["rms"] == pytest.approx(0.01, rel=0.2)
    assert "the output dead_rad_s2 is not used: it stays at 0.25" in said.err


@pytest.mark.parametrize(
    ("position", "text", "said"),
    [
        (0, bench.MODEL.replace("one_mass", "joint"), "parameters.k: missing, joint needs k, c"),
        (0, None, "No such file"),
        (1, "time_s,torque_m1_nm\n0,1\n", "column speed_rad_s: missing"),
        (2, "time_s\n", "empty or truncated"),
    ],
)
def test_wrong_input_is_refused_and_nothing_written(
    inputs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], position: int, text: str | None, said: str
) -> None:
    if text is None:
        Path(inputs[position]).unlink()
    else:
        Path(inputs[position]).write_text(text)
    assert run(["compare", *inputs, "--out", str(tmp_path / "result")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert Path(inputs[position]).name in error
    assert not (tmp_path / "result").exists()


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str, str]:
    """Return a model file, the FMU made of it, which takes a compiler its time, and a recording."""
    folder = tmp_path_factory.mktemp("exported")
    bench.record(folder / "run_1.csv", 1, noise=0.05)
    (folder / "drive.toml").write_text(bench.MODEL)
    names = tuple(str(folder / name) for name in ("drive.toml", "drive.fmu", "run_1.csv"))
    assert run(["export", "fmu", names[0], "--out", names[1]]) == 0
    return names[0], names[1], names[2]


def test_an_fmu_is_as_far_off_as_its_model_file(
    files: tuple[str, str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, fmu, recording = files
    capsys.readouterr()
    command = ["compare", model, recording, "--model", fmu, "--trust-fmu", "--out", str(tmp_path / "out"), "--json"]
    assert run(command) == 0
    models = json.loads(capsys.readouterr().out)["models"]
    own, other = (models[name]["recordings"]["run_1"] for name in ("drive.toml", "drive.fmu"))
    assert other["rms"] == pytest.approx(own["rms"], rel=1e-6)
    assert other["load_torque"] == pytest.approx(own["load_torque"], abs=1e-4)
    page = (tmp_path / "out" / "compare.html").read_text()
    assert '"drive.fmu"' in figures(page)
