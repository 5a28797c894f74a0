"""What two runs have in common and where they differ."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import Any

from hil.store.entry import Run
from hil.store.facts import facts_of, results_of

_APART = frozenset({"notes", "attachments", "settings", "eds_sha256", "id", "alarms"})


@dataclass(frozen=True, slots=True)
class Row:
    """One fact of both runs; None where a run does not have it."""

    what: str
    a: Any
    b: Any

    @property
    def differs(self) -> bool:
        """Whether the runs differ in it."""
        return bool(self.a != self.b)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two runs alongside each other; `rig_changes` are the lines of a unified diff of the rig files."""

    rows: tuple[Row, ...]
    rig_changes: tuple[str, ...]


def compare_runs(a: Run, b: Run) -> Comparison:
    """Set two runs alongside each other."""
    left, right = _flat(a), _flat(b)
    rows = tuple(Row(what, left.get(what), right.get(what)) for what in dict.fromkeys([*left, *right]))
    names = (f"run {a.run_id}", f"run {b.run_id}")
    changes = difflib.unified_diff(
        a.entry.rig_text.splitlines(), b.entry.rig_text.splitlines(), *names, lineterm="", n=1
    )
    return Comparison(rows, tuple(changes))


def _flat(run: Run) -> dict[str, Any]:
    facts = {key: value for key, value in facts_of(run).items() if key not in _APART}
    eds = {f"EDS of {inverter}": sha256 for inverter, sha256 in run.entry.eds_sha256.items()}
    return {**facts, **eds, **results_of(run)}
