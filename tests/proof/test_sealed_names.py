"""A set of cases may be someone else's: no name in it leads out of its folder, and nothing there is deleted."""

import json
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run
from hil.errors import UsageError
from hil.proof.answers import answer, judge_set
from hil.proof.command import replace_own
from hil.proof.sealed_set import CASES, COMMITMENTS, SCHEMA, VERDICTS, VERDICTS_LIST

NAMES = ["{outside}", "../victim", "..", ".", "", "a/b", "a\\b", ".hidden", "case_001/../../victim", "x\0y"]


def silent(what: str, done: int, total: int) -> None:
    pass


@pytest.fixture
def victim(tmp_path: Path) -> Path:
    folder = tmp_path / "victim"
    folder.mkdir()
    (folder / "thesis.txt").write_text("precious")
    return folder


def set_with(folder: Path, cases: dict[str, Any], listed: Path = COMMITMENTS) -> Path:
    (folder / listed).parent.mkdir(parents=True, exist_ok=True)
    (folder / listed).write_text(json.dumps({"schema": SCHEMA, "cases": cases}))
    return folder


def shown(**files: str) -> dict[str, Any]:
    return {"commitment": "0" * 64, "files": files}


@pytest.mark.parametrize("name", NAMES)
def test_a_case_named_by_a_path_is_refused_and_nothing_is_touched(tmp_path: Path, victim: Path, name: str) -> None:
    folder = set_with(tmp_path / "set", {name.format(outside=victim): shown()})
    assert run(["prove", "run", str(folder)]) == 2
    assert (victim / "thesis.txt").read_text() == "precious"
    assert [path.name for path in folder.iterdir()] == [CASES]


@pytest.mark.parametrize("name", NAMES)
def test_a_file_named_by_a_path_is_refused(tmp_path: Path, victim: Path, name: str) -> None:
    folder = set_with(tmp_path / "set", {"case_001": shown(**{name.format(outside=victim / "thesis.txt"): "0" * 64})})
    with pytest.raises(UsageError, match=r"commitments\.json: case_001: expected names of files"):
        answer(folder, 1, silent)
    folder = set_with(tmp_path / "other", {"case_001": shown()})
    set_with(folder, {"case_001": shown(**{name.format(outside=victim / "thesis.txt"): "0" * 64})}, VERDICTS_LIST)
    with pytest.raises(UsageError, match=r"verdicts\.json: case_001: expected names of files"):
        judge_set(folder, bytes(32), 1, silent)


@pytest.mark.parametrize("linked", [CASES, VERDICTS])
def test_a_link_that_leads_out_of_the_set_is_refused(tmp_path: Path, victim: Path, linked: str) -> None:
    folder = set_with(tmp_path / "set", {"case_001": shown()})
    (folder / linked).mkdir(exist_ok=True)
    (folder / linked / "case_001").symlink_to(victim)
    with pytest.raises(UsageError, match="a link that leads out of it"):
        answer(folder, 1, silent)
    assert (victim / "thesis.txt").read_text() == "precious"


def test_a_folder_that_the_tool_did_not_make_is_not_replaced(tmp_path: Path, victim: Path) -> None:
    built = tmp_path / "built"
    built.mkdir()
    (built / "diagnosis.json").write_text("{}")
    with pytest.raises(UsageError, match="got something else"):
        replace_own(victim, built)
    (tmp_path / "link").symlink_to(built)
    with pytest.raises(UsageError, match="got something else"):
        replace_own(tmp_path / "link", built)
    assert [path.name for path in victim.iterdir()] == ["thesis.txt"]
