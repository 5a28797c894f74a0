"""What an estimator remembers, as plain arrays: saved, sent, and taken up again to the bit.

A state is a mapping of names to text, whole numbers and arrays. ``numpy.savez(path, **state)`` keeps it as it is; for
JSON take ``.tolist()`` of the arrays (a double printed in full reads back as itself). Either form is restored.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimator.errors import BadSetting
from estimator.identification.online.memory import Memory

VERSION = 2
"""Goes up when a part changes its meaning; states of another version are refused."""

State = dict[str, Any]


def saved(estimator: str, memory: Memory) -> State:
    """Return the state of an estimator: its name, what it was set up with, and what it has learnt."""
    return {"estimator": estimator, "version": VERSION, **memory.settings, **memory.kept}


def restored(state: Mapping[str, Any], estimator: str, memory: Memory) -> None:
    """Write a state into the memory of an estimator of the same kind and settings.

    Raises
    ------
    BadSetting
        If the state is of another estimator, version or setting, lacks a part, or holds one of another shape or one
        that is not finite. The memory is then as it was.
    """
    for name, expected in (("estimator", estimator), ("version", VERSION)):
        _require(str(np.asarray(_part(state, name))) == str(expected), name, state[name], repr(expected))
    for name, setting in memory.settings.items():
        _require(
            np.array_equal(_numbers(state, name), setting), name, state[name], f"{setting.tolist()}, as set up here"
        )
    new = {name: _numbers(state, name) for name in memory.kept}
    for name, values in new.items():
        _require(values.shape == memory[name].shape, name, f"of shape {values.shape}", f"shape {memory[name].shape}")
        _require(bool(np.isfinite(values).all()), name, "not finite", "finite numbers only")
    for name, values in new.items():
        memory[name][...] = values


def _part(state: Mapping[str, Any], name: str) -> Any:
    _require(name in state, name, "missing", "a part of every state")
    return state[name]


def _numbers(state: Mapping[str, Any], name: str) -> np.ndarray:
    part = _part(state, name)
    try:
        return np.asarray(part, dtype=np.float64)
    except (TypeError, ValueError) as fault:
        raise BadSetting(f"state of an estimator: {name} holds {part!r}, expected numbers only.") from fault


def _require(fits: bool, name: str, got: Any, expected: str) -> None:
    if not fits:
        raise BadSetting(
            f"state of an estimator: {name} is {got}, expected {expected}. Restore it into an estimator of the same "
            "kind and settings as the one that was saved."
        )
