"""``hil compare`` with an FMU: the same figures as the model file it was made of, and only where it is trusted."""

import json
from pathlib import Path

import pytest

from hil.cli.main import run
from tests.cli import bench
from tests.report.conftest import figures


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
