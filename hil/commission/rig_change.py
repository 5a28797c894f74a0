"""Whether the rig file is the one a step was done with: its content counts, not its comments."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterator
from typing import Any


def rig_digest(text: str) -> str:
    """Return a digest of what a rig file says."""
    return hashlib.sha256(json.dumps(tomllib.loads(text), sort_keys=True, default=str).encode()).hexdigest()


def changed_keys(before: str, after: str) -> list[str]:
    """Name the keys that differ, each with its old and its new value."""
    old, new = (dict(_leaves(tomllib.loads(text))) for text in (before, after))
    return [
        f"{key}: {_shown(old, key)} → {_shown(new, key)}"
        for key in dict.fromkeys((*old, *new))
        if old.get(key) != new.get(key)
    ]


def _leaves(table: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _shown(leaves: dict[str, Any], key: str) -> str:
    return repr(leaves[key]) if key in leaves else "not there"
