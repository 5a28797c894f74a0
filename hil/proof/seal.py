"""Seals: commit to a truth before the verdict, open it after, and name what was changed in between.

A commitment is a digest of digests. Every entry of the truth has its own digest, salted with the seal's nonce
(so that nobody can try out all effects against it)::

    digest(key) = SHA-256("hil.seal/1" 0 nonce 0 key 0 canonical JSON of the value)
    commitment  = SHA-256("hil.seal/1" 0 canonical JSON of {key: digest})

The commitment is published first. An opened seal carries nonce, digests and truth: who holds the commitment
can tell that nothing was changed, or which entry was.

What is sealed in a file is encrypted: AES-256 in Galois/Counter mode (NIST SP 800-38D), by ``cryptography``.
The mode tells a changed file from a whole one; the case's name is bound in, so that no two can be exchanged.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from drivers.foreign_file import read_regular
from hil.errors import InputError, UsageError

SCHEMA = "hil.seal/1"
NONCE_BYTES = 32
_FIELDS = {"schema", "nonce", "digests", "truth"}

Truth = Mapping[str, object]

MAGIC = b"hil.sealed/1\n"
AES_NONCE_BYTES = 12
KEY_BYTES = 32


class SealBroken(InputError):
    """An opened seal is not what was committed to: changed by whoever handed it over, or damaged.

    To do: believe neither the truth nor a score that was made from it; make the case again.
    """


def canonical_json(value: object) -> bytes:
    """Return one and the same bytes for equal JSON values."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return text.encode("ascii")


def _sha256(*parts: bytes) -> str:
    return hashlib.sha256(b"\0".join((SCHEMA.encode("ascii"), *parts))).hexdigest()


def _digests(nonce: str, truth: Truth) -> dict[str, str]:
    salt = bytes.fromhex(nonce)
    return {key: _sha256(salt, key.encode("utf-8"), canonical_json(value)) for key, value in truth.items()}


@dataclass(frozen=True, slots=True)
class Seal:
    """A truth and the nonce that hides it."""

    nonce: str  # random, 64 hexadecimal digits
    truth: Truth  # what is sealed

    @property
    def commitment(self) -> str:
        """What is published beforehand: 64 hexadecimal digits that tell nothing of the truth."""
        return _sha256(canonical_json(_digests(self.nonce, self.truth)))

    def opened(self) -> dict[str, object]:
        """Return what is handed over once the verdict is written; JSON types only."""
        digests = _digests(self.nonce, self.truth)
        return {"schema": SCHEMA, "nonce": self.nonce, "digests": digests, "truth": dict(self.truth)}


def seal(truth: Truth) -> Seal:
    """Seal a truth under a fresh random nonce."""
    return Seal(secrets.token_hex(NONCE_BYTES), truth)


def verify(commitment: str, opened: object) -> dict[str, object]:
    """Return the truth of an opened seal after checking it against the commitment."""
    nonce, digests, truth = _fields(opened)
    got = _sha256(canonical_json(digests))
    if got != commitment:
        raise SealBroken(
            f"seal: expected commitment {commitment}, got {got}: this is another seal than the one "
            "committed to. Do not believe its truth."
        )
    actual = _digests(nonce, truth)
    changed = sorted(key for key in {*digests, *actual} if digests.get(key) != actual.get(key))
    if changed:
        raise SealBroken(
            f"seal: changed after it was sealed: {_names(changed, len(digests))}. Do not believe its truth."
        )
    return truth


def _names(changed: list[str], entries: int) -> str:
    if len(changed) == entries:
        return "the nonce, or every entry"
    return ", ".join(f"truth.{key}" for key in changed)


def _fields(opened: object) -> tuple[str, dict[str, str], dict[str, object]]:
    if not isinstance(opened, dict) or set(opened) != _FIELDS or opened["schema"] != SCHEMA:
        raise SealBroken(f"seal: expected an object with {', '.join(sorted(_FIELDS))} of schema {SCHEMA}")
    nonce, digests, truth = opened["nonce"], opened["digests"], opened["truth"]
    if not (isinstance(nonce, str) and len(nonce) == 2 * NONCE_BYTES and set(nonce) <= set("0123456789abcdef")):
        raise SealBroken(f"seal: nonce: expected {2 * NONCE_BYTES} hexadecimal digits, got {nonce!r}")
    if not (isinstance(digests, dict) and isinstance(truth, dict)):
        raise SealBroken("seal: digests and truth: expected an object each")
    return nonce, digests, truth


def new_key() -> str:
    """Draw a key: 64 hexadecimal digits."""
    return secrets.token_hex(KEY_BYTES)


def parse_key(text: str) -> bytes:
    """Read a key as it is printed."""
    try:
        key = bytes.fromhex(text.strip())
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise UsageError(
            f"key: expected the {2 * KEY_BYTES} hexadecimal digits that hil prove make has printed, got "
            f"{len(text.strip())} characters. Give it with --key or in a file with --key-file."
        )
    return key


def lock(key: bytes, name: str, content: bytes) -> bytes:
    """Encrypt what belongs to the case of a name."""
    nonce = secrets.token_bytes(AES_NONCE_BYTES)
    return MAGIC + nonce + AESGCM(key).encrypt(nonce, content, name.encode())


def unlock(key: bytes, name: str, path: Path) -> bytes:
    """Decrypt a file that belongs to the case of a name."""
    try:
        locked = read_regular(path)
    except OSError as error:
        raise SealBroken(f"{path}: expected what was sealed with {name}, can't be read: {error.strerror}") from error
    start = len(MAGIC) + AES_NONCE_BYTES
    if not locked.startswith(MAGIC) or len(locked) < start:
        raise SealBroken(f"{path}: expected a file sealed by hil prove make, got something else")
    try:
        return AESGCM(key).decrypt(locked[len(MAGIC) : start], locked[start:], name.encode())
    except InvalidTag:
        raise SealBroken(
            f"{path}: changed after it was sealed, or sealed with another key or for another case. Believe no score "
            "made from it."
        ) from None
