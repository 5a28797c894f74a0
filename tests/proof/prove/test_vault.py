"""Encryption of the sealed: a changed, exchanged or foreign file is reported, and so is a wrong key."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.errors import UsageError
from hil.proof.prove.vault import lock, new_key, parse_key, unlock
from hil.proof.seal import SealBroken

SECRET = b"backlash of 0.04 rad"


@pytest.fixture
def key() -> bytes:
    return parse_key(new_key())


def test_what_was_locked_comes_back_and_can_not_be_read_before(tmp_path: Path, key: bytes) -> None:
    path = tmp_path / "case_001.sealed"
    path.write_bytes(lock(key, "case_001", SECRET))
    assert SECRET not in path.read_bytes()
    assert unlock(key, "case_001", path) == SECRET


def test_equal_truths_look_different(key: bytes) -> None:
    assert lock(key, "case_001", SECRET) != lock(key, "case_001", SECRET)


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
