"""The results of a fleet as a Parquet dataset, which pandas, DuckDB and Polars read; its schemas are below.

::

    DATASET/recordings/command=diagnose/part-….parquet     a row for each recording, or each vehicle's together
    DATASET/effects/command=diagnose/part-….parquet        a row for each of them and effect
    DATASET/parameters/command=…/part-….parquet            a row for each of them and parameter
    DATASET/verdicts/KEY.json                              diagnosis.json, or identification.json
    DATASET/failures.parquet                               what was not computed, and why: of the last run

A part appears whole, its effects and parameters before its recordings, so that what is in ``recordings`` is complete
and is not computed again. Parts of the other two without one there are left over from a run that was killed.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.dataset
import pyarrow.parquet

from hil.errors import StoreError, UsageError
from hil.files import remove_abandoned, whole, write_whole

Row = dict[str, Any]

VERDICTS = "verdicts"
FAILURES = "failures.parquet"
RESULTS = "command="  # begins the name of a folder of results


def _columns(texts: str, numbers: str = "", counts: str = "") -> pa.Schema:
    kinds = ((f"key vehicle rig started name {texts}", pa.string()), (numbers, pa.float64()), (counts, pa.int64()))
    return pa.schema([(name, kind) for names, kind in kinds for name in names.split()])


TABLES: Mapping[str, pa.Schema] = {
    "recordings": _columns(
        "url sha256 verdict statement element effects fit_unit effort model model_sha256 from_fleet version",
        "duration_s fit_nominal fit_retuned fit_augmented noise_floor frequency_hz damping seconds",
        "n_recordings n_samples simulations",
    ),
    "effects": _columns("effect form element indistinguishable_from", "probability share delta_bic p_value"),
    "parameters": _columns("effect parameter unit", "value low high nominal"),
}
"""Columns of each table; ``command`` is the folder. ``effect`` is empty for a parameter of the line itself."""

_FAILURE = _columns("url command error version")

MOST_ROWS, LONGEST_S = 256, 60.0
"""Results, and time, after which a part is written: what a killed run has to compute again."""


class Writer:
    """Adds results of one command to a dataset."""

    def __init__(self, folder: Path, command: str) -> None:
        self.folder, self._command = folder, command
        self._rows: dict[str, list[Row]] = {name: [] for name in TABLES}
        self._failures: list[Row] = []
        self._written = time.monotonic()
        with room(folder):
            for name in (*TABLES, VERDICTS):
                place = folder / name if name == VERDICTS else self._place(name)
                place.mkdir(parents=True, exist_ok=True)
                remove_abandoned(place)
            self._remove_uncommitted()

    def _place(self, table: str) -> Path:
        return self.folder / table / f"{RESULTS}{self._command}"

    def _remove_uncommitted(self) -> None:
        whole_parts = {path.name for path in self._place("recordings").glob("part-*.parquet")}
        for name in ("effects", "parameters"):
            for path in self._place(name).glob("part-*.parquet"):
                if path.name not in whole_parts:
                    path.unlink()

    def known(self) -> set[str]:
        """Return the keys of what is in the dataset."""
        return {key for key in read(self.folder, "recordings", ["key"])["key"].to_pylist() if key is not None}

    def add(self, rows: Mapping[str, Sequence[Row]], verdict: str) -> None:
        """Take the rows of one recording, and its verdict's text."""
        with room(self.folder):
            write_whole(self.folder / VERDICTS / f"{rows['recordings'][0]['key']}.json", verdict)
        for name, of_table in rows.items():
            self._rows[name] += of_table
        is_due = time.monotonic() - self._written > LONGEST_S
        if is_due or len(self._rows["recordings"]) >= MOST_ROWS:
            self.flush()

    def fail(self, row: Row) -> None:
        """Take what was not computed, and why."""
        self._failures.append({**row, "command": self._command})

    def flush(self) -> None:
        """Write what has come since the last part."""
        keys = [row["key"] for row in self._rows["recordings"]]
        if keys:
            name = f"part-{hashlib.sha256(''.join(keys).encode()).hexdigest()[:16]}.parquet"
            with room(self.folder):
                for table in ("effects", "parameters", "recordings"):
                    _write(self._place(table) / name, self._rows[table], TABLES[table])
                    self._rows[table] = []
        self._written = time.monotonic()

    def finish(self) -> None:
        """Write what is left, and the failures."""
        self.flush()
        with room(self.folder):
            _write(self.folder / FAILURES, self._failures, _FAILURE)


def _write(path: Path, rows: Sequence[Row], schema: pa.Schema) -> None:
    with whole(path) as part:
        pa.parquet.write_table(pa.Table.from_pylist(list(rows), schema), part)


@contextmanager
def room(folder: Path) -> Iterator[None]:
    """Say what to do where there is none."""
    try:
        yield
    except OSError as error:
        raise UsageError(
            f"{folder}: expected room for results, got: {error.strerror or error}. What is there is whole: make room "
            "and call again, the rest is computed then."
        ) from error


def _age(path: Path) -> tuple[int, str]:
    return path.stat().st_mtime_ns, path.name


def read(folder: Path, table: str, columns: Sequence[str] | None = None) -> pa.Table:
    """Read a table of a dataset, ``failures`` among them, oldest parts first; empty where there is nothing yet."""
    schema = _FAILURE if table == "failures" else TABLES[table].append(pa.field("command", pa.string()))
    place = folder / (FAILURES if table == "failures" else table)
    files = list(place.rglob("part-*.parquet")) if place.is_dir() else [place] * place.is_file()
    if not files:
        return schema.empty_table()
    try:
        source = pa.dataset.dataset(
            [str(path) for path in sorted(files, key=_age)], schema=schema, format="parquet",
            partitioning=pa.dataset.partitioning(pa.schema([("command", pa.string())]), flavor="hive"),
        )  # fmt: skip
        return source.to_table(columns=None if columns is None else list(columns))
    except (pa.ArrowException, OSError) as error:
        raise StoreError(
            folder, f"{table}: expected a dataset of hil fleet, got a damaged one: {error}. Move the part away, and "
            "call again: what it held is computed again."
        ) from error  # fmt: skip


def require_dataset(folder: Path) -> None:
    """Refuse a folder that is no dataset."""
    if not (folder / "recordings").is_dir():
        raise UsageError(f"{folder}: expected a dataset that hil fleet diagnose or identify wrote, got none")
