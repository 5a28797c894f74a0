"""What a recording says of itself, in lines for people."""

from __future__ import annotations

from collections.abc import Mapping

from hil.recording.checksum import CHECKSUM, RIG_CHECKSUM, RIG_TEXT, SAID

_SHOWN = 16
"""Digits of a checksum that are shown: enough to distinguish any two that a person will ever compare."""

_SINGLE_LINE = 100


def self_description(metadata: Mapping[str, str]) -> list[str]:
    """Return a line for each thing that is said; long texts by their length, the rig file by its checksum."""
    if not metadata:
        return ["carries no description: no units, no rig file, no checksum"]
    lines = []
    for key, value in metadata.items():
        if key == RIG_TEXT:
            checksum = metadata.get(RIG_CHECKSUM, "")
            seal = f", SHA-256 {checksum[:_SHOWN]}" if checksum else ""
            lines.append(f"{key}: {len(value.splitlines())} lines{seal}")
        elif key == CHECKSUM:
            lines.append(f"{key}: {value[:_SHOWN]} (verified)")
        elif key not in ("schema", RIG_CHECKSUM, SAID):
            shown = value[:_SHOWN] if key.endswith("_sha256") else value
            is_short = len(shown) <= _SINGLE_LINE and "\n" not in shown
            lines.append(f"{key}: {shown}" if is_short else f"{key}: {len(value)} characters")
    return lines
