"""Seals: what was committed to is what is opened, or the change is named; encryption keeps what is sealed whole."""

import copy
import json
from pathlib import Path

import pytest

from hil.errors import UsageError
from hil.proof.seal import Seal, SealBroken, lock, new_key, parse_key, seal, unlock, verify

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
