"""Seals: what was committed to is what is opened, or the change is named; encryption keeps what is sealed whole."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run
from hil.errors import UsageError
from hil.proof.answers import answer, judge_set
from hil.proof.command import replace_own
from hil.proof.seal import Seal, SealBroken, lock, new_key, parse_key, seal, unlock, verify
from hil.proof.sealed_set import CASES, COMMITMENTS, SCHEMA, VERDICTS, VERDICTS_LIST

TRUTH = {"effect": "backlash", "seed": 7, "hidden": {"gap_rad": 0.021478117909797107}, "windows": [None, [1.5, 2]]}


@pytest.fixture
def sealed():
    return seal(TRUTH)


def _read_back(sealed):
    return json.loads(json.dumps(sealed.opened()))


def test_an_untouched_seal_gives_its_truth(sealed):
    assert verify(sealed.commitment, _read_back(sealed)) == TRUTH


def test_the_commitment_tells_nothing_and_differs_each_time(sealed):
    assert sealed.commitment != seal(TRUTH).commitment
    assert len(sealed.commitment) == 64


@pytest.mark.parametrize(
    ("key", "value"), [("effect", "none"), ("seed", 7.5), ("hidden", {"gap_rad": 0.02}), ("windows", [])]
)
def test_a_changed_entry_is_named(sealed, key, value):
    opened = _read_back(sealed)
    opened["truth"][key] = value
    with pytest.raises(SealBroken, match=rf"changed after it was sealed: truth\.{key}\."):
        verify(sealed.commitment, opened)


def test_a_digest_changed_along_with_its_entry_is_another_seal(sealed):
    opened = Seal(sealed.nonce, {**TRUTH, "effect": "none"}).opened()
    with pytest.raises(SealBroken, match="another seal than the one"):
        verify(sealed.commitment, opened)


def _without(key):
    return lambda opened: opened.pop(key)


def _with(key, value):
    return lambda opened: opened.update({key: value})


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_without("nonce"), "expected an object with digests, nonce, schema, truth"),
        (_with("schema", "hil.seal/9"), "of schema hil.seal/1"),
        (_with("nonce", "xyz"), "nonce: expected 64 hexadecimal digits, got 'xyz'"),
        (_with("nonce", None), "nonce: expected 64 hexadecimal digits, got None"),
        (_with("truth", []), "digests and truth: expected an object each"),
        (_with("digests", "abc"), "digests and truth: expected an object each"),
    ],
)
def test_a_damaged_seal_is_refused_by_name(sealed, damage, message):
    opened = copy.deepcopy(_read_back(sealed))
    damage(opened)
    with pytest.raises(SealBroken, match=message):
        verify(sealed.commitment, opened)


SECRET = b"backlash of 0.04 rad"


@pytest.fixture
def key() -> bytes:
    return parse_key(new_key())


def test_what_was_locked_comes_back_and_can_not_be_read_before(tmp_path: Path, key: bytes) -> None:
    path = tmp_path / "case_001.sealed"
    path.write_bytes(lock(key, "case_001", SECRET))
    assert SECRET not in path.read_bytes()
    assert unlock(key, "case_001", path) == SECRET


@pytest.mark.parametrize("place", [0, 15, 40, -1], ids=["magic", "nonce", "content", "tag"])
def test_one_changed_byte_is_reported_with_the_file_s_name(tmp_path: Path, key: bytes, place: int) -> None:
    locked = bytearray(lock(key, "case_001", SECRET))
    locked[place] ^= 1
    path = tmp_path / "case_001.sealed"
    path.write_bytes(locked)
    with pytest.raises(SealBroken, match=r"case_001\.sealed"):
        unlock(key, "case_001", path)


def test_another_key_another_case_and_no_file_are_reported(tmp_path: Path, key: bytes) -> None:
    path = tmp_path / "case_001.sealed"
    path.write_bytes(lock(key, "case_001", SECRET))
    with pytest.raises(SealBroken, match="another key"):
        unlock(parse_key(new_key()), "case_001", path)
    with pytest.raises(SealBroken, match="another case"):
        unlock(key, "case_002", path)
    with pytest.raises(SealBroken, match="can't be read"):
        unlock(key, "case_001", tmp_path / "absent.sealed")


@pytest.mark.parametrize("text", ["", "12ab", "x" * 64, "0" * 63])
def test_what_is_no_key_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="expected the 64 hexadecimal digits"):
        parse_key(text)


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
