"""Model files with faults, read by the commands that take one; and one that is good, but of another motion."""

from pathlib import Path

import pytest

from tests.bad_input.conftest import Refused, with_changes
from tests.cli import bench

STIFF = {"J_M": 1.6, "J_L": 95.0, "k": 4.2e12, "c": 9.0, "b_M": 0.35, "b_L": 0.9}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([("[parameters]", "[parameters")], ["line 5, column 12 | expected TOML"]),
        (
            [("J_M", "J_X"), ("motion =", "motio =")],
            ["motio | expected one of the known keys", "parameters.J_M: missing", "parameters.J_X: unknown"],
        ),
        (
            [("[parameters]", "[signals]\nspeed = { column = 'v', scale = 0.0 }\nfoo = 1\n[parameters]")],
            ["signals.speed.scale | expected a number other than 0", "signals.foo | expected one of the known keys"],
        ),
    ],
)
def test_each_fault_is_named_and_nothing_is_written(
    refused: Refused, drive: Path, changes: list[tuple[str, str]], said: list[str]
) -> None:
    model = drive / "drive.toml"
    model.write_text(with_changes(bench.MODEL, changes), encoding="utf-8")
    complaint = refused("simulate", "--model", model, "--input", drive / "run_1.csv", "--out", drive / "simulated.csv")
    assert all(f"{model}: {each}" in complaint for each in said), complaint
    assert not (drive / "simulated.csv").exists()


def test_a_line_too_stiff_for_the_sample_time_is_refused_at_once(refused: Refused, drive: Path) -> None:
    """It took minutes before: the integration steps per sample grow with the line's natural frequency."""
    model = drive / "drive.toml"
    two_mass = "".join(f"{name} = {{ value = {value}, tolerance = 0.2 }}\n" for name, value in STIFF.items())
    head, _, _ = bench.MODEL.replace("one_mass", "two_mass").partition("J_M")
    model.write_text(head + two_mass, encoding="utf-8")
    complaint = refused("simulate", "--model", model, "--input", drive / "run_1.csv", "--out", drive / "simulated.csv")
    assert "parameters.k = 4.2e+12 with parameters.J_M = 1.6: the line's natural frequency is 2.6" in complaint
    assert "expected at most 1500 Hz at a sample time of 0.01 s" in complaint
    assert not (drive / "simulated.csv").exists()


@pytest.mark.parametrize(
    "command",
    [
        "simulate --model MODEL --input REC --out OUT.csv",
        "compare MODEL REC --out OUT",
        "diagnose REC --model MODEL --out OUT",
        "identify REC --model MODEL --out OUT",
    ],
)
def test_a_translation_is_not_held_against_a_motor_speed(refused: Refused, drive: Path, command: str) -> None:
    model = drive / "drive.toml"
    model.write_text(bench.MODEL.replace("rotation", "translation"), encoding="utf-8")
    words = {"MODEL": str(model), "REC": str(drive / "run_1.csv"), "OUT": str(drive / "out")}
    complaint = refused(*(words.get(word, word.replace("OUT", words["OUT"])) for word in command.split()))
    assert f"{model}: motion | expected 'rotation'" in complaint
    assert "[signals]" in complaint
    assert sorted(path.name for path in drive.iterdir()) == ["drive.toml", "run_1.csv"]


def test_a_translation_turns_no_shaft_of_a_simulated_rig(refused: Refused, tmp_path: Path, rig_text: str) -> None:
    (tmp_path / "slide.toml").write_text(bench.MODEL.replace("rotation", "translation"), encoding="utf-8")
    rig = tmp_path / "rig.toml"
    rig.write_text(with_changes(rig_text, [('# model = "model.toml"', 'model = "slide.toml"')]), encoding="utf-8")
    assert "simulation.model: expected motion = 'rotation', got 'translation'" in refused("sim", rig)
