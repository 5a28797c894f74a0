"""``hil diagnose``: the whole line on recordings whose missing physics is known, and its refusals."""

import json
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from estimator.diagnosis.first_use import COMPILING
from hil.cli.command_line import silence
from hil.cli.diagnose import progress_bar
from hil.cli.main import run
from hil.config.model_file import read_model
from tests.cli import bench

DRY_NM = 2.0


@pytest.fixture(scope="module")
def bench_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    for seed in (1, 2, 3):
        bench.record(folder / f"run_{seed}.csv", seed, noise=0.02, dry=DRY_NM)
    bench.model(folder / "drive.toml", bench.MODEL + "\n[signals]\ntime = { column = 'time_s' }\n")
    return folder


@pytest.fixture(scope="module")
def result(bench_folder: Path) -> Path:
    out = bench_folder / "deep" / "result"
    recordings = [str(bench_folder / f"run_{seed}.csv") for seed in (1, 2, 3)]
    arguments = [*recordings[:2], "--model", str(bench_folder / "drive.toml"), "--out", str(out)]
    with redirect_stdout(StringIO()) as printed, redirect_stderr(StringIO()) as complaints:
        assert run(["diagnose", *arguments, "--holdout", recordings[2], "--json"]) == 0
    assert printed.getvalue() == (out / "diagnosis.json").read_text()
    assert complaints.getvalue() == ""
    return out


def test_the_dry_friction_that_was_put_in_is_found(result: Path) -> None:
    content = json.loads((result / "diagnosis.json").read_text())
    assert content["schema"] == "hil.diagnosis/1"
    assert content["verdict"] == "explained"
    assert [effect["name"] for effect in content["effects"]] == ["coulomb_friction_motor"]
    found = content["effects"][0]["parameters"]["friction_nm"]
    assert found["value"] == pytest.approx(DRY_NM, rel=0.05)
    assert content["fit"]["augmented"] < 0.2 * content["fit"]["retuned"]


def test_the_augmented_model_is_valid_input_and_keeps_the_signals(result: Path, bench_folder: Path) -> None:
    file = read_model(result / "augmented.toml")
    assert list(file.model.effects) == ["coulomb_friction_motor"]
    assert file.signals == read_model(bench_folder / "drive.toml").signals
    simulated = bench_folder / "simulated.csv"
    arguments = ["--model", str(result / "augmented.toml"), "--input", str(bench_folder / "run_3.csv")]
    assert run(["simulate", *arguments, "--out", str(simulated)]) == 0


def test_the_search_is_listed_set_by_set(
    result: Path, bench_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sets = json.loads((result / "diagnosis.json").read_text())["effort"]["sets"]
    nothing, best = sets[0], next(each for each in sets if each["outcome"] == "believed")
    assert (nothing["effects"], nothing["started_from"]) == ([], [])
    assert (best["effects"], best["started_from"], best["score"]) == (["coulomb_friction_motor"], [], 0.0)
    assert best["rms"] < 0.2 * nothing["rms"]
    assert all(each["score"] is None or each["score"] >= 0.0 for each in sets)
    assert sets == sorted(sets, key=lambda each: len(each["effects"]))
    arguments = [str(bench_folder / "run_1.csv"), "--model", str(bench_folder / "drive.toml"), "--explain"]
    assert run(["diagnose", *arguments, "--out", str(tmp_path / "result")]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Every set of effects that was fitted." in printed
    assert "nothing – " in printed  # the first row: the nominal model is started from none
    assert "on the way of the search" in printed


def test_a_full_disk_takes_the_files_but_not_the_verdict(
    bench_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("hil.report.diagnosis_files.write_model", full)
    out = tmp_path / "result"
    arguments = [str(bench_folder / "run_1.csv"), "--model", str(bench_folder / "drive.toml"), "--json"]
    assert run(["diagnose", *arguments, "--out", str(out)]) == 2
    reported = capsys.readouterr()
    assert json.loads(reported.out)["effects"][0]["name"] == "coulomb_friction_motor"
    assert "No space left on device. Make room there" in reported.err
    assert not out.exists()


@pytest.mark.parametrize("quiet", [False, True])
def test_that_it_compiles_is_said_once_to_a_log_too(quiet: bool, capsys: pytest.CaptureFixture[str]) -> None:
    with silence(quiet), progress_bar() as progress:
        for stage in ("preparing", "fitting"):
            progress(f"{stage} ({COMPILING})", 0.5)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == ("" if quiet else f"preparing ({COMPILING})\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("run_1.csv --model drive.toml --out OUT --holdout nowhere.csv run_9.csv", "run_9.csv"),
        ("nowhere.csv --model drive.toml --out OUT", "nowhere.csv: expected a readable file"),
        ("run_1.csv --model nowhere.toml --out OUT", "nowhere.toml"),
        ("run_1.csv --model run_1.csv --out OUT", "expected TOML"),
        ("run_1.csv run_1.csv --model drive.toml --out OUT", "got 'run_1' twice"),
        ("run_1.csv --model drive.toml --out OUT --holdout run_1.csv", "got 'run_1' twice"),
        ("run_1.csv --model drive.toml --out drive.toml", "which is a file"),
        ("run_1.csv --model drive.toml", "--out"),
        ("--model drive.toml --out OUT", "REC"),
        ("run_1.csv --model drive.toml --out OUT --holdout", "--holdout"),
    ],
)
def test_wrong_input_is_refused_and_nothing_written(
    bench_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: str,
    said: str,
) -> None:
    monkeypatch.chdir(bench_folder)
    out = tmp_path / "result"
    assert run(["diagnose", *words.replace("OUT", str(out)).split()]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()
