"""A set of cases from the making to the scoreboard, and everything that may be tampered with on the way."""

import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from hil.proof import answers, command
from hil.proof.answers import answer, judge_set
from hil.proof.command import CommandFailed
from hil.proof.kinds import draw
from hil.proof.scoreboard import Board, scoreboard_files
from hil.proof.seal import SealBroken, new_key, parse_key
from hil.proof.sealed_set import CASES, SEALED, VERDICTS, VERDICTS_LIST, make
from hil.provenance import provenance
from tests.proof.conftest import recordings_of

SEED, COUNT = 5, 2
KEY = parse_key(new_key())
DIAGNOSIS = {
    "verdict": "unexplained",
    "mismatch": {"detected": True, "element": "speed_sensor"},
    "effects": [],
    "parameters": {},
    "fit": {"retuned": 1.0, "augmented": 1.0, "noise_floor": 0.05},
}


def silent(what: str, done: int, total: int) -> None:
    assert 0 < done <= total


class Tool:
    """Stands for the command line: abstains always, and keeps what it was shown."""

    def __init__(self) -> None:
        self.seen: list[dict[str, str]] = []
        self.fails = False

    def __call__(self, arguments: Sequence[str], folder: Path, limit_s: float) -> None:
        if self.fails:
            raise CommandFailed("hil diagnose: ended with status 3: no bus")
        if arguments[0] == "diagnose":
            files = [path for path in folder.parent.rglob("*") if path.is_file()]
            self.seen.append({path.name: path.read_text() for path in files})
            out = folder.parent / "out"
            (out / "diagnosis.json").write_text(json.dumps(DIAGNOSIS))
            (out / "augmented.toml").write_text("a model")
            return
        read = np.genfromtxt(folder / "fresh.csv", delimiter=",", names=True)
        simulated = np.column_stack([read["time_s"], read["speed_rad_s"] + 0.1])
        header = "time_s,speed_sim_rad_s"
        np.savetxt(folder / "simulated.csv", simulated, delimiter=",", header=header, comments="")


@pytest.fixture
def tool(monkeypatch: pytest.MonkeyPatch) -> Tool:
    tool = Tool()
    for module in (answers, command):
        monkeypatch.setattr(module, "run_hil", tool)
    return tool


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("prove") / "set"
    with recordings_of(300):
        make(folder, COUNT, SEED, KEY, 2, silent)
    return folder


@pytest.fixture
def proof(made: Path, tmp_path: Path) -> Path:
    """A copy that a test may spoil."""
    folder = tmp_path / "set"
    for path in made.rglob("*"):
        if path.is_file():
            target = folder / path.relative_to(made)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    return folder


def test_what_is_shown_and_what_is_sealed_tells_nothing(made: Path) -> None:
    assert sorted(path.name for path in (made / CASES / "case_001").iterdir()) == [
        "model.toml",
        "run_1.csv",
        "run_2.csv",
        "run_3.csv",
    ]
    readable = b"".join(path.read_bytes() for path in made.rglob("*") if path.is_file())
    for each in draw(COUNT, SEED):
        assert each.kind.name.encode() not in readable
        assert str(each.seed).encode() not in readable


@pytest.mark.usefixtures("brief")
def test_the_same_seed_makes_the_same_recordings(made: Path, tmp_path: Path) -> None:
    make(tmp_path / "again", 1, SEED, KEY, 1, silent)
    for name in ("model.toml", "run_1.csv"):
        path = Path(CASES) / "case_001" / name
        assert (tmp_path / "again" / path).read_bytes() == (made / path).read_bytes()


@pytest.mark.usefixtures("brief")
def test_an_interrupted_making_leaves_nothing(tmp_path: Path) -> None:
    def interrupt(what: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(tmp_path / "set", 2, SEED, KEY, 1, interrupt)
    assert not list(tmp_path.iterdir())


def test_the_command_sees_one_case_and_nothing_else(proof: Path, tool: Tool) -> None:
    answer(proof, 1, silent)
    assert [set(files) for files in tool.seen] == [{"model.toml", "run_1.csv", "run_2.csv", "run_3.csv"}] * COUNT


def test_answers_are_scored_against_the_truth(proof: Path, tool: Tool, tmp_path: Path) -> None:
    digest = answer(proof, 2, silent)
    rows = judge_set(proof, KEY, 2, silent, digest)
    assert [row["case"] for row in rows] == ["case_001", "case_002"]
    assert [row["kind"] for row in rows] == [each.kind.name for each in draw(COUNT, SEED)]
    assert {row["outcome"] for row in rows} == {"abstained"}
    assert rows[0]["fresh_over_floor"] == pytest.approx([2.0, 2.0, 2.0], rel=1e-6)  # 0.1 over 0.05 rad/s
    shown = proof / "cases"
    made = provenance(sorted(shown.rglob("*.toml")), sorted(shown.rglob("*.csv")))
    for name, write in scoreboard_files(Board(rows, made=made)).items():
        write(tmp_path / name)
    page = (tmp_path / "scoreboard.html").read_text()
    for row in rows:
        assert row["kind"] in page
        assert f'href="verdicts/{row["case"]}/report.html"' in page
    assert not re.search(r'(src|href)="https?://', page)
    data = json.loads((tmp_path / "scoreboard.json").read_text())
    assert data["schema"] == "hil.scoreboard/1"
    assert data["false_claims"]["hits"] == 0
    assert len(data["cases"]) == COUNT
    assert len(data["made"]["models"]) == COUNT
    assert {each["sha256"] in page for each in data["made"]["recordings"]} == {True}


def test_answering_continues_where_it_was_interrupted(proof: Path, tool: Tool) -> None:
    def interrupt(what: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        answer(proof, 1, interrupt)
    tool.seen.clear()
    answer(proof, 1, silent)
    assert len(tool.seen) < COUNT
    tool.seen.clear()
    answer(proof, 1, silent)
    assert tool.seen == []


def _append(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b" ")


@pytest.mark.parametrize(
    "spoilt",
    [
        f"{CASES}/case_002/run_1.csv",
        f"{SEALED}/case_002.sealed",
        f"{VERDICTS}/case_002/diagnosis.json",
        f"{VERDICTS}/case_002/augmented.toml",
    ],
    ids=["case", "truth", "verdict", "model"],
)
def test_what_was_tampered_with_is_named(proof: Path, tool: Tool, spoilt: str) -> None:
    answer(proof, 1, silent)
    _append(proof / spoilt)
    with pytest.raises(SealBroken, match=re.escape(str(Path(spoilt).name))):
        judge_set(proof, KEY, 1, silent)


def test_verdicts_and_their_list_changed_together_are_reported_by_the_digest_that_was_kept(
    proof: Path, tool: Tool
) -> None:
    digest = answer(proof, 1, silent)
    listed = json.loads((proof / VERDICTS_LIST).read_text())
    listed["cases"]["case_001"]["diagnose_s"] = 99.0
    (proof / VERDICTS_LIST).write_text(json.dumps(listed))
    with pytest.raises(SealBroken, match="got others"):
        judge_set(proof, KEY, 1, silent, digest)


def test_rigs_and_real_recordings_stand_on_the_same_page(tmp_path: Path) -> None:
    rig = {
        "case": "clutch_closed",
        "where": "the PLC: the clutch stays closed",
        "said": "PLC: clutch is closed, expected open.",
        "outcome": "right",
        "success": True,
    }
    agreement = {
        "what": "gap",
        "unit": "mm",
        "truth": 4.06,
        "found": 4.1,
        "ci95": [4.0, 4.2],
        "inside": True,
        "within": True,
        "asked": "within 10 % of 4.06 mm",
    }
    run = {
        "name": "sines",
        "verdict": "explained",
        "named": ["backlash"],
        "fault": None,
        "held_out": {"before": 1.11, "after": 0.2},
        "right": True,
        "agreements": [agreement],
        "report": "joint/sines/report.html",
    }
    case = {"title": "A <joint>", "concealed": ["backlash"], "conceals": "its gap", "runs": [run]}
    for name, write in scoreboard_files(Board([], [rig], [case])).items():
        write(tmp_path / name)
    page = (tmp_path / "scoreboard.html").read_text()
    assert "Over the wire: 1 of 1" in page
    assert "clutch is closed" in page
    assert "A &lt;joint&gt;" in page
    assert 'href="real/joint/sines/report.html"' in page
    assert "1.11" in page
    assert "holds it" in page
    assert json.loads((tmp_path / "scoreboard.json").read_text())["wire"] == [rig]
