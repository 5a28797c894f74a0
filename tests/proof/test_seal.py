"""Seals: what was committed to is what is opened, or the change is named."""

import copy
import json

import pytest

from hil.proof.seal import Seal, SealBroken, canonical_json, seal, verify

TRUTH = {
    "effect": "backlash",
    "seed": 7,
    "hidden": {"gap_rad": 0.021478117909797107},
    "windows": [None, [1.5, 2]],
}


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


def test_order_of_entries_does_not_matter(sealed):
    turned = Seal(sealed.nonce, dict(reversed(TRUTH.items())))
    assert turned.commitment == sealed.commitment


@pytest.mark.parametrize(
    ("key", "value"), [("effect", "none"), ("seed", 7.5), ("hidden", {"gap_rad": 0.02}), ("windows", [])]
)
def test_a_changed_entry_is_named(sealed, key, value):
    opened = _read_back(sealed)
    opened["truth"][key] = value
    with pytest.raises(SealBroken, match=rf"changed after it was sealed: truth\.{key}\."):
        verify(sealed.commitment, opened)


def test_a_removed_and_an_added_entry_are_named(sealed):
    opened = _read_back(sealed)
    opened["truth"]["more"] = opened["truth"].pop("seed")
    with pytest.raises(SealBroken, match=r"truth\.more, truth\.seed"):
        verify(sealed.commitment, opened)


def test_a_changed_nonce_is_named(sealed):
    opened = _read_back(sealed)
    opened["nonce"] = "0" * 64
    with pytest.raises(SealBroken, match="the nonce, or every entry"):
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


def test_something_that_is_no_seal_is_refused(sealed):
    with pytest.raises(SealBroken, match="expected an object"):
        verify(sealed.commitment, ["truth"])


def test_numbers_json_does_not_have_are_refused():
    with pytest.raises(ValueError, match="Out of range float"):
        canonical_json({"gap_rad": float("nan")})
