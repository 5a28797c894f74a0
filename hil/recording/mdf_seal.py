"""The checksum of a whole MDF file, inside it: whether it is safe to hand to a parser that trusts what it reads.

A property ``file_sha256`` of the file's comment holds the SHA-256 of the file with 64 zeros in its own place. asammdf's
compiled parts end the process on some damaged files, so a file that is as it was written is read here, and any other
in a process of its own (`hil.recording.mdf_apart`).
"""

from __future__ import annotations

import hashlib
import re

KEY = "file_sha256"
PLACEHOLDER = "0" * 64

_PROPERTY = re.compile(rb'name="' + KEY.encode() + rb'">([0-9a-f]{64})<')

_SEARCHED_BYTES = 1 << 20
"""The comment follows the header of 168 bytes; as much of the file is looked through."""


def seal(content: bytes) -> bytes:
    """Put the checksum into a file that was written with the placeholder."""
    found = _PROPERTY.search(content, 0, _SEARCHED_BYTES)
    if found is None:
        return content
    return content[: found.start(1)] + _digest(content, found) + content[found.end(1) :]


def is_as_written(content: bytes) -> bool:
    """Whether a file has a checksum of its own, and fits it."""
    found = _PROPERTY.search(content, 0, _SEARCHED_BYTES)
    return found is not None and found.group(1) == _digest(content, found)


def _digest(content: bytes, found: re.Match[bytes]) -> bytes:
    digest = hashlib.sha256(content[: found.start(1)])
    digest.update(PLACEHOLDER.encode())
    digest.update(content[found.end(1) :])
    return digest.hexdigest().encode()
