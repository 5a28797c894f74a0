"""Options that few use do what they say: each is followed to where it acts."""

from pathlib import Path

import pytest
from rich.console import Console

from estimator.physics.model import Motion
from hil.cli import fleet
from hil.cli.commission_job import job_in, who_answers
from hil.cli.main import run
from hil.cli.options import Pace
from hil.config.model_file import read_model
from hil.design.damper import asked
from hil.fleet.run import Engine
from hil.fleet.tasks import FleetJob
from hil.orders.operator import StepChoice
from hil.orders.order import RigSource
from tests.cli.bus_model import MODEL
from tests.cli.conftest import EXAMPLE

VALUES = [word for value in ("J_M=20", "b_M=4") for word in ("--value", value)]


def test_a_new_model_of_a_linear_axis_is_one_of_translation(tmp_path: Path) -> None:
    path = tmp_path / "axis.toml"
    line = ["model", "new", str(path), "--yes", "--structure", "one_mass", *VALUES]
    assert run([*line, "--motion", "translation"]) == 0
    assert read_model(path).model.motion is Motion.TRANSLATION
    assert run(["model", "new", str(tmp_path / "b.toml"), *line[3:], "--motion", "screw"]) == 2
    assert not (tmp_path / "b.toml").exists()


def test_a_damper_may_take_no_more_than_its_share_of_the_torque() -> None:
    usual, little = (asked(EXAMPLE, 0.3, share).demand.limit_nm for share in (0.25, 0.01))
    assert little < usual
    assert run(["design", "damper", "--model", "no.toml", "--share", "2"]) == 2  # more than there is


def test_a_commissioning_is_given_the_way_of_the_vehicle_and_what_becomes_of_results(tmp_path: Path) -> None:
    console = Console()
    source = RigSource(EXAMPLE, EXAMPLE.read_text(), None, None, False)
    jobs = [job_in(tmp_path, source, None, False, travel, Pace.FAST, console) for travel in (None, 0.05)]
    assert [job.travel_is_given for job in jobs] == [False, True]
    assert jobs[1].travel_m_per_rad == 0.05
    assert run(["commission", str(EXAMPLE), "--out", str(tmp_path), "--dry-run", "--travel", "-1"]) == 2
    kept, repeated = (who_answers(console, False, why).keep_results(["[guard]"]) for why in ("a note", ""))
    assert (kept.what, kept.because, repeated.what) == (StepChoice.GO, "a note", StepChoice.REPEAT)


def test_a_fleet_is_diagnosed_by_vehicle_and_by_what_is_usual_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bus.toml").write_text(MODEL)
    asked_for: list[bool] = []
    work: list[tuple[str | None, Engine, float]] = []

    def carry_out(
        sources: object,
        out: object,
        job: FleetJob,
        by_vehicle: bool,
        pattern: str | None,
        engine: Engine,
        *rest: object,
    ) -> None:
        asked_for.append(by_vehicle)
        work.append((pattern, engine, job.budget_s))

    monkeypatch.setattr(fleet, "_carry_out", carry_out)
    line = ["fleet", "diagnose", str(tmp_path), "--model", str(tmp_path / "bus.toml"), "--out", str(tmp_path / "out")]
    assert run([*line, "--by", "vehicle"]) == run(line) == 0
    assert asked_for == [True, False]
    assert run([*line, "--prior", str(tmp_path)]) == 2
    assert "expected a dataset that hil fleet" in capsys.readouterr().err
    assert len(asked_for) == 2
    options = ("--pattern", "(?P<vehicle>b)/", "--jobs", "3", "--memory", "1GiB", "--retries", "0", "--budget-s", "60")
    assert run([*line, *options]) == 0
    assert work[-1] == ("(?P<vehicle>b)/", Engine(None, 3, "1GiB", 0), 60.0)
