"""``hil diagnose`` with an FMU: what acts at its inputs and outputs is named, and it runs only where it is trusted."""

import gc
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import acts_around
from estimator.physics.catalogue import EFFECTS
from hil.cli.main import run
from hil.errors import UsageError
from hil.export.fmu import package
from hil.plants import fmu_plant
from hil.plants.fmu_line import fmu_line
from hil.plants.fmu_plant import FmuPlant
from hil.plants.names import names
from hil.recording import read_record
from hil.recording.sandbox import Sandbox
from tests.cli import bench

RUBBING = (
    bench.MODEL
    + """
[effects.coulomb_friction_motor]
friction_nm = { value = 4.0 }
"""
)
"""With dry friction in it, no line answers as the FMU does."""

MOST_SIMULATIONS = 400

LATE = 3
"""Samples by which the torque acts later than it was read."""


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("exported")
    (folder / "drive.toml").write_text(bench.MODEL)
    assert run(["export", "fmu", str(folder / "drive.toml"), "--out", str(folder / "drive.fmu")]) == 0
    return str(folder / "drive.fmu")


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("exported")
    (folder / "rubbing.toml").write_text(RUBBING)
    assert run(["export", "fmu", str(folder / "rubbing.toml"), "--out", str(folder / "rubbing.fmu")]) == 0
    return str(folder / "rubbing.fmu")


def late(path: Path, dry: float = 0.0) -> str:
    """Write a recording under other names, its torque read earlier than it acted."""
    bench.record(path, 1, noise=0.02, dry=dry, n=350)
    time, first, second, speed = np.loadtxt(path, delimiter=",", skiprows=1).T
    rows = slice(0, time.size - LATE)
    columns = [time[rows], (first + second)[LATE:], speed[rows]]
    np.savetxt(path, np.column_stack(columns), delimiter=",", header="t,T,w", comments="", fmt="%.12g")
    return str(path)


SIGNALS = """[signals]
time = { column = "t" }
torque = [{ column = "T" }]
speed = { column = "w" }
"""


def test_what_acts_at_an_input_is_named(fmu: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording, out = late(tmp_path / "run_1.csv"), tmp_path / "out"
    (tmp_path / "signals.toml").write_text(SIGNALS)
    mapped = [word for each in ("torque=T_M1", "output=speed_motor", "start=start.speed") for word in ("--map", each)]
    given = ["--signals", str(tmp_path / "signals.toml"), "--trust-fmu", *mapped, "--effort", "quick"]
    assert run(["diagnose", recording, "--model", fmu, "--out", str(out), *given]) == 0
    found = json.loads((out / "diagnosis.json").read_text())
    assert [effect["name"] for effect in found["effects"]] == ["transport_delay"]
    delay = found["effects"][0]["parameters"]["delay_s"]["value"]
    assert delay == pytest.approx(LATE * bench.DT, rel=0.05)
    assert found["fit"]["augmented"] == pytest.approx(0.02, rel=0.15)
    assert {key: each["value"] for key, each in found["parameters"].items()} == pytest.approx(
        {"J_M": bench.J, "b_M": bench.B}, rel=1e-3
    )  # a line answers as the FMU, and nothing of it is re-tuned without --tune
    assert "To drive.fmu would have to be added: before T_M1 transport_delay." in found["statement"]
    assert [each["file"] for each in found["made"]["models"]] == [fmu]
    assert {path.name for path in out.iterdir()} == {"augmented.ssp", "augmented.toml", "diagnosis.json", "report.html"}


@pytest.mark.campaign  # some 340 simulations, twice
def test_what_acts_at_an_input_is_named_where_no_line_answers_so(rubbing: str, tmp_path: Path) -> None:
    recording, out = late(tmp_path / "run_1.csv", dry=4.0), tmp_path / "out"
    (tmp_path / "signals.toml").write_text(SIGNALS)
    mapped = [word for each in ("torque=T_M1", "output=speed_motor", "start=start.speed") for word in ("--map", each)]
    given = ["--signals", str(tmp_path / "signals.toml"), "--trust-fmu", *mapped, "--effort", "quick"]
    answers = []
    for jobs in ("1", "2"):
        assert run(["diagnose", recording, "--model", rubbing, "--out", str(out), *given, "--jobs", jobs]) == 0
        answers.append(json.loads((out / "diagnosis.json").read_text()) | {"timing_s": None, "made": None})
    found, other = answers
    assert found == other
    assert [effect["name"] for effect in found["effects"]] == ["transport_delay"]
    assert found["parameters"] == {}
    assert "No line of one or two inertias answers as rubbing.fmu does" in found["statement"]
    assert int(found["statement"].partition("It was simulated ")[2].split()[0]) <= MOST_SIMULATIONS
    assert {path.name for path in out.iterdir()} == {"augmented.ssp", "diagnosis.json", "report.html"}


def test_where_no_line_answers_so_the_fmu_itself_is_simulated(rubbing: str, tmp_path: Path) -> None:
    bench.record(tmp_path / "run_1.csv", 1, noise=0.02, dry=4.0, n=350)
    found = fmu_line(FmuPlant(Path(rubbing), [], trusted=True), [read_record(tmp_path / "run_1.csv")], {})
    assert not found.is_alike
    plant = found.model.plant
    assert plant is not None
    reached = {name for name, entry in EFFECTS.items() if acts_around(entry, plant)}
    assert {"transport_delay", "coulomb_friction_motor", "speed_filter"} <= reached
    assert not {"backlash", "tyre_slip"} & reached


def test_a_parameter_is_retuned_by_its_name_in_the_fmu(fmu: str, tmp_path: Path) -> None:
    """The friction is 10 % above the FMU's; nothing else is missing."""
    (tmp_path / "other.toml").write_text(bench.MODEL.replace(f"value = {bench.B}", f"value = {bench.B / 1.1}"))
    other, recording, out = tmp_path / "other.fmu", tmp_path / "run_1.csv", tmp_path / "out"
    assert run(["export", "fmu", str(tmp_path / "other.toml"), "--out", str(other)]) == 0
    bench.record(recording, 1, noise=0.02, n=700)
    given = ["--trust-fmu", "--effort", "quick", "--tune", "b_M=20%"]
    assert run(["diagnose", str(recording), "--model", str(other), "--out", str(out), *given]) == 0
    found = json.loads((out / "diagnosis.json").read_text())
    assert found["verdict"] == "no_mismatch"
    tuned = found["parameters"]["b_M"]
    assert tuned["nominal"] == pytest.approx(bench.B / 1.1, rel=1e-9)
    assert tuned["ci95"][0] <= bench.B <= tuned["ci95"][1]
    assert tuned["ci95"][1] - tuned["ci95"][0] < 0.1 * bench.B


@pytest.mark.parametrize(
    ("tuned", "said"),
    [
        ("nowhere=20%", "--tune nowhere: expected a real parameter of the FMU. It has: "),
        ("J_M", "expected NAME=20% or NAME=0.2"),
        ("J_M=120%", "expected NAME=20% or NAME=0.2"),
        ("step_s=20%", "--tune step_s: expected a parameter that the output shows"),
    ],
)
def test_what_can_not_be_tuned_is_refused(
    tuned: str, said: str, fmu: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.record(tmp_path / "run_1.csv", 1, n=300, noise=0.02)
    given = ["--model", fmu, "--trust-fmu", "--tune", tuned, "--out", str(tmp_path / "out")]
    assert run(["diagnose", str(tmp_path / "run_1.csv"), *given]) == 2
    assert said in capsys.readouterr().err


def test_a_look_names_what_is_meant_and_runs_nothing(fmu: str, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert run(["look", fmu, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["map"] == {
        "torque": ["T_M1", "T_M2"],
        "output": ["speed_measured"],
        "load": ["T_load"],
        "load_speed": [],
        "start": ["start.speed"],
    }
    assert found["doubtful"]["output"] == ["speed_motor"]


def test_it_is_simulated_as_its_model_file(fmu: str, tmp_path: Path) -> None:
    bench.record(tmp_path / "run_1.csv", 1, n=300)
    (tmp_path / "drive.toml").write_text(bench.MODEL)
    columns = []
    for model, more in ((fmu, ["--trust-fmu"]), (str(tmp_path / "drive.toml"), [])):
        out = tmp_path / "simulated.csv"
        command = ["simulate", "--model", model, "--input", str(tmp_path / "run_1.csv"), "--out", str(out), *more]
        assert run(command) == 0
        columns.append(np.loadtxt(out, delimiter=",", skiprows=1))
    np.testing.assert_allclose(columns[0], columns[1], atol=1e-5)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([], "runs only where you trust it: --trust-fmu"),
        (["--trust-fmu", "--map", "output=w"], "expected a variable of the FMU, got 'w'. It has: "),
        (["--trust-fmu", "--map", "start=J_M"], "expected a finite speed_measured over run_1, got NaN or infinity"),
    ],
)
def test_what_is_not_trusted_or_named_is_refused(
    more: list[str], said: str, fmu: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.record(tmp_path / "run_1.csv", 1, n=300)
    assert run(["diagnose", str(tmp_path / "run_1.csv"), "--model", fmu, "--out", str(tmp_path / "out"), *more]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["torque=T_M1,T_M1"], "expected each name once"),
        (["output=speed_motor,speed_load"], "expected one name"),
        (["torque=T_M1", "torque=T_M2"], "expected torque once, got it twice"),
        (["speed=w"], "KEY one of torque, output, load, start"),
        (["load=w"], "load=w: expected a variable of the FMU"),
    ],
)
def test_what_map_can_not_mean_is_refused(given: list[str], said: str) -> None:
    with pytest.raises(UsageError, match=re.escape(said)):
        names(given, ("T_M1", "T_M2", "speed_measured", "speed_load"))


HANGS = """#include <fcntl.h>
#include <unistd.h>
fmi2Status fmi2EnterInitializationMode(Instance c) {{
    int begun = open("{counter}", O_WRONLY | O_CREAT | O_APPEND, 0600);
    if (write(begun, "x", 1) != 1 || lseek(begun, 0, SEEK_END) == {good} + 1) for (;;) pause();
    close(begun);
    """


class Seen(Sandbox):
    """Keeps every process of an FMU."""

    every: ClassVar[list[subprocess.Popen[bytes]]] = []

    def __init__(self, module: str) -> None:
        super().__init__(module)
        self.every.append(self._process)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize(
    ("good", "budget_s", "status", "said"),
    [
        (0, "3", 2, "in 3 s (--budget-s)"),
        pytest.param(40, "20", 0, "Not decided: the search was ended after 20 s", marks=pytest.mark.campaign),
    ],
)
def test_one_that_hangs_ends_with_the_budget(
    good: int,
    budget_s: str,
    status: int,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """At its first simulation there is no diagnosis; at a later one, once, nothing is decided. No process is left."""
    before, own = "fmi2Status fmi2EnterInitializationMode(Instance c) { ", package.own
    assert before in own("fmi2.c")
    hangs = HANGS.format(counter=tmp_path / "begun", good=good)
    monkeypatch.setattr(package, "own", lambda name: own(name).replace(before, hangs))
    monkeypatch.setattr(fmu_plant, "Sandbox", Seen)
    Seen.every.clear()
    (tmp_path / "drive.toml").write_text(RUBBING)
    export = ["export", "fmu", str(tmp_path / "drive.toml"), "--fmi", "2.0", "--out", str(tmp_path / "drive.fmu")]
    assert run(export) == 0
    bench.record(tmp_path / "run_1.csv", 1, noise=0.02, dry=4.0, n=350)
    given = ["--model", str(tmp_path / "drive.fmu"), "--trust-fmu", "--budget-s", budget_s, "--out"]
    capsys.readouterr()
    assert run(["diagnose", str(tmp_path / "run_1.csv"), *given, str(tmp_path / "out")]) == status
    printed = capsys.readouterr()
    assert said in printed.out + printed.err
    assert len((tmp_path / "begun").read_bytes()) > good
    gc.collect()
    assert Seen.every
    assert all(process.poll() is not None for process in Seen.every)
