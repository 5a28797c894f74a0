"""All rigs of the proof, one after the other; what is there already is not driven again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hil.errors import UsageError
from hil.files import read_json
from hil.proof.prove.make import Progress
from hil.proof.wire.concealed import WIRED
from hil.proof.wire.drive import Row, drive

SCHEMA = "hil.wire/1"
RESULTS = "wire.json"
LIMIT_S = 600.0
"""Time one command may take [s]."""


def run_wire(out: Path, seed: int, names: Sequence[str], progress: Progress, limit_s: float = LIMIT_S) -> list[Row]:
    """Drive rigs; returns their rows, also written to ``out/wire.json``.

    Parameters
    ----------
    names
        Of `WIRED`; all by default of the command line.

    Raises
    ------
    UsageError
        If a name is none of them.
    """
    for name in names:
        if name not in WIRED:
            raise UsageError(f"rig {name!r}: expected one of {', '.join(WIRED)}")
    rows = {row["case"]: row for row in read_rows(out) if row["seed"] == seed and not row["fault"]}
    for number, name in enumerate(names, start=1):
        if name not in rows:
            rows[name] = drive(name, WIRED[name], seed, out, limit_s)
            _write(out / RESULTS, list(rows.values()))
        progress(f"rig {name} driven", number, len(names))
    return [rows[name] for name in names]


def read_rows(out: Path) -> list[Row]:
    """Return the rows that an earlier run has left; none where there was none.

    Raises
    ------
    UsageError
        If they can't be read.
    """
    path = out / RESULTS
    if not path.exists():
        return []
    try:
        data = read_json(path)
        rows: list[Row] = data["rigs"]
    except (ValueError, KeyError, TypeError) as error:
        raise UsageError(
            f"{path}: expected an object of schema {SCHEMA} with rigs, got: {error}. Remove it."
        ) from error
    return rows


def _write(path: Path, rows: list[dict[str, Any]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.unfinished")
    unfinished.write_text(json.dumps({"schema": SCHEMA, "rigs": rows}, indent=1) + "\n", encoding="utf-8")
    unfinished.replace(path)
