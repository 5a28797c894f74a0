"""Encryption of what is sealed: AES-256 in Galois/Counter mode (NIST SP 800-38D), by the ``cryptography`` package.

The mode tells a changed file from a whole one; the case's name is bound in, so that no two can be exchanged.
"""

from __future__ import annotations

import secrets
from pathlib import Path

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from hil.errors import UsageError
from hil.proof.seal import SealBroken

MAGIC = b"hil.sealed/1\n"
NONCE_BYTES = 12
KEY_BYTES = 32


def new_key() -> str:
    """Draw a key: 64 hexadecimal digits."""
    return secrets.token_hex(KEY_BYTES)


def parse_key(text: str) -> bytes:
    """Read a key as it is printed.

    Raises
    ------
    UsageError
        If it is none.
    """
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
    nonce = secrets.token_bytes(NONCE_BYTES)
    return MAGIC + nonce + AESGCM(key).encrypt(nonce, content, name.encode())


def unlock(key: bytes, name: str, path: Path) -> bytes:
    """Decrypt a file that belongs to the case of a name.

    Raises
    ------
    SealBroken
        If it is not there, no sealed file, changed since it was sealed, or sealed with another key.
    """
    try:
        locked = path.read_bytes()
    except OSError as error:
        raise SealBroken(f"{path}: expected what was sealed with {name}, can't be read: {error.strerror}") from error
    start = len(MAGIC) + NONCE_BYTES
    if not locked.startswith(MAGIC) or len(locked) < start:
        raise SealBroken(f"{path}: expected a file sealed by hil prove make, got something else")
    try:
        return AESGCM(key).decrypt(locked[len(MAGIC) : start], locked[start:], name.encode())
    except InvalidTag:
        raise SealBroken(
            f"{path}: changed after it was sealed, or sealed with another key or for another case. Believe no score "
            "made from it."
        ) from None
