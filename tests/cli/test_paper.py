"""``hil paper``: figures from experiments it drives, and from recordings it is given."""

import json
from pathlib import Path

import pytest

from hil.cli import paper
from hil.cli.main import run
from tests.cli.bus_model import MODEL

RUNS = 2
DURATION_S = 14.0
FIGURES = [f"{figure}.{suffix}" for figure in ("fig2", "fig4", "fig5") for suffix in ("pdf", "svg")]


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Drive fewer and shorter experiments than the command does by itself."""
    out = tmp_path_factory.mktemp("paper") / "made" / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paper, "EXPERIMENTS", RUNS)
        assert run(["paper", "--out", str(out), "--seed", "3", "--duration", str(DURATION_S)]) == 0
    return out


def test_everything_is_there_and_nothing_else(driven: Path) -> None:
    recordings = [name for k in range(RUNS) for name in (f"run_{k + 1}.csv", f"run_{k + 1}.csv.json")]
    expected = [*FIGURES, "paper.json", "report.html", "rig.toml", *recordings]
    assert sorted(path.name for path in driven.iterdir()) == sorted(expected)
    for name in FIGURES:
        assert (driven / name).stat().st_size > 5_000
    assert (driven / "fig4.svg").read_text().startswith("<?xml")


def test_the_numbers_hold_the_truth_of_each_experiment(driven: Path) -> None:
    document = json.loads((driven / "paper.json").read_text())
    assert (document["schema"], document["seed"]) == ("hil.paper/1", 3)
    assert (document["settings"]["na"], document["settings"]["nb"], document["settings"]["nk"]) == (4, 4, 1)
    assert (document["settings"]["sample_time_s"], document["settings"]["samples"]) == (0.02, 1024)
    conditions = document["conditions"]
    for row, each in zip(document["experiments"], conditions, strict=True):
        assert row["online_hz"] == pytest.approx(row["reference_hz"], rel=0.02)
        assert row["online_damping"] == pytest.approx(row["reference_damping"], rel=0.15)
        assert each["speed_rad_s"] > 0
    lighter, heavier = sorted(zip(conditions, document["experiments"], strict=True), key=lambda p: p[0]["payload_kg"])
    assert lighter[1]["reference_hz"] > heavier[1]["reference_hz"]  # the resonance falls with the load's inertia


def test_recordings_of_ones_own_are_held_against_a_model_file(
    driven: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "bus.toml"
    model.write_text(MODEL)
    out = tmp_path / "out"
    arguments = ["paper", str(driven / "run_1.csv"), "--model", str(model), "--out", str(out), "--delay", "0", "--json"]
    assert run(arguments) == 0
    printed = capsys.readouterr().out
    assert printed == (out / "paper.json").read_text()
    document = json.loads(printed)
    assert (document["seed"], document["conditions"], document["settings"]["nk"]) == (None, [], 0)
    assert document["experiments"][0]["reference_hz"] == pytest.approx(8.22, abs=0.01)
    assert sorted(path.name for path in out.iterdir()) == sorted([*FIGURES, "paper.json", "report.html"])


@pytest.mark.parametrize(
    ("more", "named"),
    [
        (("--model", "bus.toml"), "expected recordings with --model"),
        (("--duration", "0"), "expected a number of seconds above 0"),
        (("--duration", "nan"), "expected a number of seconds above 0"),
        (("lost.csv",), "lost.csv"),
        (("--delay", "-1"), "delay"),
    ],
)
def test_wrong_use_is_refused_and_nothing_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], named: str
) -> None:
    assert run(["paper", "--out", str(tmp_path / "out"), *more]) == 2
    assert named in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
