"""Sealed rigs driven by the public command: what is written, judged and kept; the driving itself is a stand-in here."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hil.proof import rigs
from hil.proof.command import CommandFailed
from hil.proof.rigs import RESULTS, run_wire
from hil.proof.sealed_rig import Challenge, draw_challenge

SEED = 7
REFUSAL = "hil run: ended with status 3: error: PLC: clutch is closed, expected open. Nothing was armed."


def silent(what: str, done: int, total: int) -> None:
    assert 0 < done <= total


class Tool:
    """Stands for the command line: finds what it is ordered to find."""

    def __init__(self, named: str = "", refuses: bool = False) -> None:
        self.named, self.refuses = named, refuses
        self.asked: list[str] = []
        self.seen: set[str] = set()

    def __call__(self, arguments: Sequence[str], folder: Path, limit_s: float) -> None:
        self.asked.append(arguments[0])
        self.seen |= {path.name for path in folder.parent.rglob("*") if path.is_file()}
        if arguments[0] == "run":
            if self.refuses:
                raise CommandFailed(REFUSAL)
            (folder / arguments[-1]).write_text("a recording")
        if arguments[0] == "diagnose":
            (folder / "diagnosis.json").write_text(json.dumps(self._diagnosis()))

    def _diagnosis(self) -> dict[str, Any]:
        effect = {
            "name": self.named,
            "element": "acquisition",
            "parameters": {},
            "indistinguishable_from": [],
            "time_s": {},
        }
        return {
            "verdict": "explained" if self.named else "no_mismatch",
            "mismatch": {"detected": bool(self.named), "element": "acquisition" if self.named else None},
            "effects": [effect] if self.named else [],
            "parameters": {},
            "fit": {"retuned": 1.0, "augmented": 0.05, "noise_floor": 0.05},
        }


@dataclass(frozen=True)
class Sealed:
    """A sealed rig that nobody drives; the one in its own process takes seconds to start."""

    challenge: Challenge
    bus: str = "ws://127.0.0.1:1/"
    modbus: str = "127.0.0.1:1"

    @property
    def commitment(self) -> str:
        return self.challenge.seal.commitment

    def open(self) -> object:
        return json.loads(json.dumps(self.challenge.seal.opened()))


@contextmanager
def sealed_here(*arguments: str) -> Iterator[Sealed]:
    options = dict(zip(arguments[::2], arguments[1::2], strict=True))
    yield Sealed(draw_challenge(int(options["--seed"]), options["--effect"]))


@pytest.fixture
def without_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rigs, "sealed_process", sealed_here)


def use(monkeypatch: pytest.MonkeyPatch, tool: Tool) -> Tool:
    monkeypatch.setattr(rigs, "run_hil", tool)
    return tool


@pytest.mark.campaign
def test_the_tool_gets_addresses_and_nominal_model_and_is_judged_by_the_opened_seal(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tool = use(monkeypatch, Tool())
    (row,) = run_wire(tmp_path, SEED, ["nothing"], silent)
    assert tool.asked == ["check", "run", "run", "run", "diagnose"]
    assert tool.seen <= {"rig.toml", "nominal.toml", "cruise.csv", "reversal.csv", "tip.csv"}
    assert (row["outcome"], row["success"]) == ("right", True)
    assert (tmp_path / "nothing" / "diagnosis.json").is_file()
    assert json.loads((tmp_path / RESULTS).read_text())["rigs"] == [row]


@pytest.mark.usefixtures("without_processes")
def test_a_vehicle_that_must_not_be_driven_is_right_when_it_is_refused_for_that_reason(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    use(monkeypatch, Tool(refuses=True))
    (row,) = run_wire(tmp_path / "refused", SEED, ["clutch_closed"], silent)
    assert row["success"]
    assert "clutch is closed" in row["said"]
    use(monkeypatch, Tool("backlash"))
    (row,) = run_wire(tmp_path / "driven", SEED, ["clutch_closed"], silent)
    assert (row["outcome"], row["success"]) == ("drove all the same", False)


@pytest.mark.usefixtures("without_processes")
def test_rigs_that_were_driven_are_not_driven_again_but_those_that_failed_are(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    use(monkeypatch, Tool(refuses=True))
    (row,) = run_wire(tmp_path, SEED, ["nothing"], silent)
    assert row["outcome"] == "failed"
    tool = use(monkeypatch, Tool())
    assert run_wire(tmp_path, SEED, ["nothing"], silent)[0]["success"]
    tool.asked.clear()
    run_wire(tmp_path, SEED, ["nothing"], silent)
    assert tool.asked == []
    run_wire(tmp_path, SEED + 1, ["nothing"], silent)
    assert tool.asked[0] == "check"
