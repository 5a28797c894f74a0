"""The last step of a commissioning: the loop of ``hil solve``, with a rig and a diagnosis that are made up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from estimator.diagnosis.result import Verdict
from hil.commission.engine import NAMES, Commissioning, StepRequests
from hil.commission.state import CommissioningState, Status, StepRecord, load_state
from hil.commission.step import StepContext
from hil.config.model_file import write_model
from hil.design import solve
from hil.design.design import Aim
from hil.errors import UsageError
from hil.orders.operator import Talk
from hil.orders.order import Order, rig_digest
from hil.orders.runner import RunRecord
from hil.report.commission_html import commission_page
from hil.simulator.driveline import DEFAULT_BUS
from tests.commission.whole_state import EVIDENCE
from tests.design.test_candidates import SOURCE

YES = Talk(None, True)
SPEED = {"speed_measured_rad_s": [10.0, 20.0]}
OPEN, DECIDED = {"backlash": 0.6, "shaft_hysteresis": 0.4}, {"backlash": 0.97, "shaft_hysteresis": 0.03}


class World:
    """All steps before are done; after so many recordings one of two explanations is left."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder, self.enough, self.factor = folder, 3, 12.0
        self.driven: list[str] = []
        self.asked: list[str] = []
        self.said: list[str] = []
        self.fails: list[BaseException] = []
        (folder / "runs").mkdir()
        write_model(folder / "nominal.toml", DEFAULT_BUS)
        monkeypatch.setattr(solve, "read_records", lambda paths, *_: tuple(path.read_text() for path in paths))
        monkeypatch.setattr(solve, "left_open", self._left_open)
        monkeypatch.setattr(solve, "designed", self._designed)
        monkeypatch.setattr(solve, "design_lines", lambda *_: [])
        monkeypatch.setattr(solve, "_lines", lambda *_: [])
        monkeypatch.setattr(solve, "publish_diagnosis", self._publish)

    def diagnosed(self, verdict: str, *alike: str) -> None:
        """Leave the state of a commissioning whose diagnosis came to this."""
        state = CommissioningState(self.folder, "bus", "rig.toml", SOURCE.text, {name: StepRecord() for name in NAMES})
        for record in list(state.steps.values())[:-1]:
            record.begin(rig_digest(SOURCE.text), keep_runs=False)
            record.end(Status.DONE)
        state.steps["validation"].evidence = EVIDENCE["validation"]
        state.steps["diagnosis"].evidence = EVIDENCE["diagnosis"] | {"verdict": verdict, "alike": list(alike)}
        state.steps["experiments"].runs = [self._recorded("experiments", f"cruise{i}", SPEED) for i in (1, 2)]
        state.save()

    def call(self, talk: Talk = YES, **asked: Any) -> StepRecord:
        self.asked.clear()
        Commissioning(self._job(), talk, StepRequests(**asked), lambda *_: None).run()
        return self.record

    @property
    def state(self) -> CommissioningState:
        state = load_state(self.folder, NAMES)
        assert state is not None
        return state

    @property
    def record(self) -> StepRecord:
        return self.state.steps["solve"]

    def person(self, *answers: str) -> Talk:
        given = iter(answers)

        def ask(question: str) -> str:
            self.asked.append(question)
            return next(given)

        return Talk(ask)

    def _job(self) -> StepContext:
        runner: Any = SimpleNamespace(folder=self.folder, predictions=self._predictions, run=self._run)
        return StepContext(SOURCE, SOURCE.rig(), self.state, runner, None, 0.1, True, self.said.append, lambda *_: None)

    def _recorded(self, step: str, name: str, measured: dict[str, Any], whole: bool = True) -> RunRecord:
        path = self.folder / "runs" / f"{step}-{name}.csv"
        path.write_text(name, encoding="utf-8")
        return RunRecord(name, f"runs/{path.name}", whole, 5.0, {}, measured, last_rad_s=3.0)

    def _predictions(self, *_: object) -> list[Any]:
        nothing = SimpleNamespace(low=0.0, high=0.0)
        return [SimpleNamespace(seconds=5.0, torque_m1_nm=nothing, torque_m2_nm=nothing, speed_rad_s=nothing)]

    def _run(self, step: str, order: Order, lines: object, rolling: float, note: Callable[[RunRecord], None]) -> Any:
        self.driven.append(order.name)
        run = self._recorded(step, order.name, {}, whole=not self.fails)
        note(run)
        if self.fails:
            raise self.fails.pop()
        return run

    def _left_open(self, records: tuple[str, ...], *_: object) -> Any:
        odds = OPEN if len(records) < self.enough else DECIDED
        left = [SimpleNamespace(name=name, probability=p, effects=frozenset({name})) for name, p in odds.items()]
        decided = odds is DECIDED
        known = SimpleNamespace(
            candidates=left,
            is_decided=decided,
            named=left[0].effects,
            against=(),
            untested=(),
            supposed={},
            twins={},
            unnamed=None,
        )
        return known, SimpleNamespace(verdict=Verdict.EXPLAINED, statement=f"after {len(records)} recordings")

    def _designed(self, *_: object) -> Any:
        expected = SimpleNamespace(factor=self.factor, right=0.9)
        planned = SimpleNamespace(name="steps about standstill", table={"kind": "tip"})
        worth = self.factor >= 3.0
        return SimpleNamespace(
            aim=Aim.DECIDE, planned=planned, decides=expected, shows=(), factor=self.factor, is_worth_driving=worth
        )

    def _publish(self, folder: Path, *_: object) -> None:
        folder.mkdir(exist_ok=True)
        (folder / "augmented.toml").write_text("augmented", encoding="utf-8")


@pytest.fixture
def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> World:
    return World(tmp_path, monkeypatch)


@pytest.mark.parametrize("verdict", ["explained", "no_mismatch"])
def test_a_decided_diagnosis_costs_nothing_and_asks_nobody(world: World, verdict: str) -> None:
    world.diagnosed(verdict)
    record = world.call(Talk(None))
    assert (record.status, world.driven) == (Status.SKIPPED, [])
    assert record.because.startswith("the diagnosis has decided. nothing missing")
    assert not (world.folder / "solve").exists()


def test_another_verdict_of_a_repeated_diagnosis_is_seen(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    world.diagnosed("explained")
    world.call()
    state = world.state
    state.steps["diagnosis"].evidence["verdict"] = "unexplained"
    state.steps["diagnosis"].status = Status.INTERRUPTED
    state.save()
    monkeypatch.setattr("hil.commission.engine.STEPS", _with_a_diagnosis_that_does_nothing())
    assert world.call().status is Status.DONE
    assert world.driven == ["next_1"]


@pytest.mark.parametrize(("verdict", "alike"), [("unexplained", ()), ("explained", ("shaft_hysteresis",))])
def test_what_is_open_is_driven_until_it_is_decided(world: World, verdict: str, alike: tuple[str, ...]) -> None:
    world.enough = 4
    world.diagnosed(verdict, *alike)
    record = world.call()
    assert world.driven == ["next_1", "next_2"]
    assert (record.status, record.evidence["end"]) == (Status.DONE, "decided")
    assert [each["probabilities"] for each in record.evidence["odds"]] == [OPEN, OPEN, DECIDED]
    assert [each.measured.rpartition("After: ")[2].partition(",")[0] for each in record.findings[:2]] == [
        "backlash in the shaft line 0.600",
        "backlash in the shaft line 0.970",
    ]
    assert record.findings[-1].within is True
    assert (world.folder / "model.toml").read_text(encoding="utf-8") == "augmented"
    page = commission_page(world.state.document(), {name: name for name in NAMES})
    for text in (
        "steps about standstill",
        "backlash in the shaft line 0.970",
        "solve/report.html",
        "after 4 recordings",
    ):
        assert text in page
    assert world.call().attempt == 1


def test_declined_the_verdict_stands_with_the_operators_reason(world: World) -> None:
    world.diagnosed("unexplained")
    record = world.call(world.person("s", "no room"))
    assert (record.status, record.evidence["end"], world.driven) == (Status.DONE, "the operator declined", [])
    assert record.findings[-1].measured == "explained: backlash in the shaft line 0.600, hysteresis of the shaft 0.400"
    assert record.findings[-1].advice.startswith("no room")
    assert world.call(world.person()).attempt == 1
    assert world.call(world.person("y"), repeat=frozenset({"solve"})).evidence["end"] == "decided"


def test_ended_in_a_run_or_at_a_question_it_continues_with_what_was_driven(world: World) -> None:
    world.enough = 4
    world.diagnosed("unexplained")
    with pytest.raises(KeyboardInterrupt):
        world.call(world.person("y", "q"))
    assert world.record.status is Status.INTERRUPTED
    world.fails = [KeyboardInterrupt()]
    with pytest.raises(KeyboardInterrupt):
        world.call()
    record = world.call()
    assert world.driven == ["next_1", "next_2", "next_2"]
    assert (record.status, record.attempt, len(record.evidence["driven"])) == (Status.DONE, 3, 2)


def test_without_yes_and_terminal_no_torque(world: World) -> None:
    world.diagnosed("unexplained")
    with pytest.raises(UsageError, match="commands torque: expected someone at a terminal"):
        world.call(Talk(None))
    assert world.driven == []


def test_limits_that_are_in_the_way_are_named_with_how_far(world: World) -> None:
    world.factor = 1.5
    world.diagnosed("unexplained")
    record = world.call()
    assert (record.status, world.driven) == (Status.DONE, [])
    assert record.findings[-1].within is None
    assert "2.7 times the duration ([design] most_duration_s)" in record.findings[-1].advice


def _with_a_diagnosis_that_does_nothing() -> Any:
    from dataclasses import replace

    from hil.commission.engine import STEPS
    from hil.commission.step import Outcome

    def same(job: StepContext) -> Outcome:
        return Outcome((), dict(job.evidence("diagnosis")))

    return tuple(replace(step, do=same) if step.name == "diagnosis" else step for step in STEPS)
