"""The order of things: skip, repeat, resume, block, quit, a rig file that changed; with steps that do nothing."""

from pathlib import Path

import pytest

from hil.commission import engine
from hil.commission.engine import Commissioning, StepRequests
from hil.commission.state import CommissioningState, Status, StepFinding, StepRecord, load_state
from hil.commission.step import Outcome, Step, StepContext
from hil.errors import RunAborted, UsageError
from hil.orders.operator import Talk
from hil.orders.order import RigSource
from tests.commission.rigs import EXAMPLE

NAMES = ("first", "second", "third")


class World:
    """Three steps of which each says what it did; the second commands torque, the third is computed from it."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.done: list[str] = []
        self.said: list[str] = []
        self.fails: dict[str, BaseException] = {}
        self.findings: dict[str, list[StepFinding]] = {}
        self.text = EXAMPLE.read_text(encoding="utf-8")
        needs: dict[str, tuple[str, ...]] = {"first": (), "second": ("first",), "third": ("second",)}
        steps = tuple(Step(name, name, lambda job: "acts.", self._doer(name), needs=needs[name]) for name in NAMES)
        monkeypatch.setattr(engine, "STEPS", steps)
        run = engine.PlannedRun("run", 1.0, (0.0, 5.0), (0.0, 5.0), (0.0, 1.0))
        monkeypatch.setattr(engine, "plan_of", lambda job, step: [run] if step.name == "second" else [])

    def _doer(self, name: str):  # type: ignore[no-untyped-def]
        def do(job: StepContext) -> Outcome:
            self.done.append(name)
            if name in self.fails:
                raise self.fails.pop(name)
            return Outcome(self.findings.pop(name, []), {"of": name})

        return do

    def state(self) -> CommissioningState:
        source = RigSource(EXAMPLE, self.text)
        return load_state(self.folder, NAMES) or CommissioningState(
            self.folder, "rig", str(source.path), self.text, {name: StepRecord() for name in NAMES}
        )

    def call(self, talk: Talk | None = None, **asked: object) -> list[str]:
        self.done.clear()
        source = RigSource(EXAMPLE, self.text)
        job = StepContext(
            source, source.rig(), self.state(), None, None, 0.1, True, self.said.append, lambda a, b: None
        )  # type: ignore[arg-type]
        Commissioning(job, talk or Talk(None, True), StepRequests(**asked), lambda step, findings: None).run()  # type: ignore[arg-type]
        return list(self.done)


@pytest.fixture
def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> World:
    return World(tmp_path, monkeypatch)


def person(*answers: str) -> Talk:
    given = iter(answers)
    return Talk(lambda question: next(given))


def test_every_step_once_and_then_none(world: World) -> None:
    assert world.call() == list(NAMES)
    assert world.call() == []


def test_continues_at_the_step_that_was_interrupted(world: World) -> None:
    world.fails["second"] = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        world.call()
    assert [record.status for record in world.state().steps.values()] == [
        Status.DONE,
        Status.INTERRUPTED,
        Status.PENDING,
    ]
    assert world.call() == ["second", "third"]
    assert world.state().steps["second"].attempt == 2


def test_program_that_was_killed_left_its_step_interrupted(world: World) -> None:
    state = world.state()
    state.steps["first"].begin("", keep_runs=False)
    state.save()
    assert world.state().steps["first"].status is Status.INTERRUPTED
    assert "killed" in world.state().steps["first"].because


def test_repeated_and_what_is_computed_from_it(world: World) -> None:
    world.call()
    assert world.call(repeat=frozenset({"second"})) == ["second", "third"]
    assert world.state().steps["second"].history[0].status is Status.DONE


def test_blocking_finding_ends_it_and_is_done_again(world: World) -> None:
    world.findings["first"] = [StepFinding("sign", "forward", "backward", False, "Swap two phases", blocking=True)]
    with pytest.raises(RunAborted, match=r"step first: sign: expected forward, got backward\. Swap two phases"):
        world.call()
    assert world.state().steps["first"].status is Status.BLOCKED
    assert world.call() == list(NAMES)


def test_without_yes_and_terminal_no_torque(world: World) -> None:
    with pytest.raises(UsageError, match="step second commands torque: expected someone at a terminal"):
        world.call(Talk(None, False))
    assert world.done == ["first"]


def test_person_continues_skips_or_quits(world: World) -> None:
    assert world.call(person("what?", "s", "", "no torque today")) == ["first", "third"]
    assert world.state().steps["second"].because == "no torque today"
    with pytest.raises(KeyboardInterrupt):
        world.call(person("q"), repeat=frozenset({"second"}))


@pytest.mark.parametrize("damage", ["", "{", '{"schema": "hil.other/1"}', '{"schema": "hil.commission/1"}', "[1]"])
def test_damaged_state_is_refused_by_name(world: World, damage: str) -> None:
    world.call()
    world.state().path.write_text(damage, encoding="utf-8")
    with pytest.raises(UsageError, match=r"commission\.json: expected the state of a commissioning"):
        world.call()


def test_state_is_whole_or_as_it_was(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    world.call()
    state = world.state()
    before = state.path.read_bytes()
    monkeypatch.setattr("os.fsync", _full_disk)
    state.steps["first"].because = "changed"
    with pytest.raises(UsageError, match=r"commission\.json: expected room .* No space left"):
        state.save()
    assert state.path.read_bytes() == before
    assert [path.name for path in world.folder.iterdir()] == ["commission.json"]


def test_what_ended_a_step_is_reported_where_the_state_can_not_be_kept(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    save = CommissioningState.save

    def save_while_there_is_room(state: CommissioningState) -> None:
        if any(record.status is Status.INTERRUPTED for record in state.steps.values()):
            raise UsageError("no room")
        save(state)

    monkeypatch.setattr(CommissioningState, "save", save_while_there_is_room)
    world.fails["second"] = RunAborted("the bus is gone")
    with pytest.raises(RunAborted, match="the bus is gone") as ended:
        world.call()
    assert ended.value.__notes__ == ["no room"]


def _full_disk(descriptor: int) -> None:
    raise OSError(28, "No space left on device")
