"""The results of a fleet as a Parquet dataset, which pandas, DuckDB and Polars read; its schemas are below.

::

    DATASET/recordings/command=diagnose/part-….parquet     a row for each recording, or each vehicle's together
    DATASET/effects/command=diagnose/part-….parquet        a row for each of them and effect
    DATASET/parameters/command=…/part-….parquet            a row for each of them and parameter
    DATASET/verdicts/KEY.json                              diagnosis.json, or identification.json
    DATASET/failures.parquet                               what was not computed, and why: of the last run
    DATASET/survey.parquet                                 what is known of every recording (`hil.fleet.known`)

A part appears whole, its effects and parameters before its recordings, so that what is in ``recordings`` is complete
and is not computed again. Parts of the other two without one there are left over from a run that was killed.

A dataset may be somebody else's: a number that is none is read as missing, and what can't be a row of ours is refused.
"""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute
import pyarrow.parquet

from drivers.foreign_file import open_regular
from hil.errors import RecordingError, StoreError, UsageError
from hil.files import remove_abandoned, whole, write_whole
from hil.recording.bounds import require_cells

DatasetRow = dict[str, Any]

VERDICTS = "verdicts"
FAILURES = "failures.parquet"
SURVEY = "survey.parquet"
RESULTS = "command="  # begins the name of a folder of results

PLACE = ("vehicle", "rig", "started", "name", "url")
"""Columns of where a recording belongs, which the last survey says."""

LARGEST = 1e100
"""From here on a number is of nothing that is measured, and its square may be beyond a float."""

MOST_ROWS, LONGEST_S = 256, 60.0
"""Results, and time, after which a part is written: what a killed run has to compute again."""


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

_FILES: Mapping[str, pa.Schema] = {
    FAILURES.removesuffix(".parquet"): _columns("url command error version"),
    SURVEY.removesuffix(".parquet"): pa.schema(
        [(name, pa.string()) for name in ("url", "stamp", "sha256", "said_vehicle", "said_rig", "said_started")]
    ),
}
"""Columns of the tables that are one file, replaced by each call."""


class Writer:
    """Adds results of one command to a dataset, which it alone may use meanwhile (`hil.result_folder.sole_use`)."""

    def __init__(self, folder: Path, command: str) -> None:
        self.folder, self._command = folder, command
        self._rows: dict[str, list[DatasetRow]] = {name: [] for name in TABLES}
        self._failures: list[DatasetRow] = []
        self._written = time.monotonic()
        with room(folder):
            for name in (*TABLES, VERDICTS):
                place = folder / name if name == VERDICTS else self._place(name)
                place.mkdir(parents=True, exist_ok=True)
                remove_abandoned(place)
            remove_abandoned(folder)
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
        return set().union(*_keys_of_parts(self.folder).values())

    def settle(self, place_of: Callable[[Sequence[str]], DatasetRow | None]) -> None:
        """Have one row for each key, the last, and say of each where it belongs now.

        ``place_of`` returns the columns `PLACE` for the checksums of a row's recordings, None where nothing is known.
        """
        keys = _keys_of_parts(self.folder)
        for path in _parts(self.folder, "recordings"):
            places: dict[str, DatasetRow] = {}
            for row in _table(path, TABLES["recordings"]).to_pylist():
                if row["key"] in keys[path.parent.name, path.name]:
                    places[row["key"]] = place_of(row["sha256"].split()) or {name: row[name] for name in PLACE}
            with room(self.folder):
                self._settle_part(path, places)

    def _settle_part(self, of_recordings: Path, places: Mapping[str, DatasetRow]) -> None:
        """Write a part of all tables again where it changes."""
        command = of_recordings.parent.name
        for table in ("effects", "parameters", "recordings"):
            path = self.folder / table / command / of_recordings.name
            schema = TABLES[table]
            before = _table(path, schema).to_pylist() if path.is_file() else []
            after: list[DatasetRow] = []
            kept: set[str] = set()
            for row in before:
                if row["key"] in places and (table != "recordings" or row["key"] not in kept):
                    kept.add(row["key"])
                    place = places[row["key"]]
                    after.append(row | {name: place[name] for name in PLACE if name in row})
            if after != before:
                _write(path, after, schema, keep_age=True)

    def add(self, rows: Mapping[str, Sequence[DatasetRow]], verdict: str) -> None:
        """Take the rows of one recording, and its verdict's text."""
        with room(self.folder):
            write_whole(self.folder / VERDICTS / f"{rows['recordings'][0]['key']}.json", verdict)
        for name, of_table in rows.items():
            self._rows[name] += of_table
        is_due = time.monotonic() - self._written > LONGEST_S
        if is_due or len(self._rows["recordings"]) >= MOST_ROWS:
            self.flush()

    def fail(self, row: DatasetRow) -> None:
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

    def survey(self, rows: Sequence[DatasetRow]) -> None:
        """Keep what is known of every recording."""
        with room(self.folder):
            _write(self.folder / SURVEY, rows, _FILES["survey"])

    def finish(self) -> None:
        """Write what is left, and the failures."""
        self.flush()
        with room(self.folder):
            _write(self.folder / FAILURES, self._failures, _FILES["failures"])


def _write(path: Path, rows: Sequence[DatasetRow], schema: pa.Schema, keep_age: bool = False) -> None:
    """Write a part; one that is written again keeps its time, by which the last result is found."""
    times = (path.stat().st_atime_ns, path.stat().st_mtime_ns) if keep_age else None
    with whole(path) as part:
        pa.parquet.write_table(pa.Table.from_pylist(list(rows), schema), part)
        if times is not None:
            os.utime(part, ns=times)


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


def _parts(folder: Path, table: str) -> list[Path]:
    """Return the parts of a table, the oldest first."""
    return sorted((folder / table).glob(f"{RESULTS}*/part-*.parquet"), key=_age)


def _keys_of_parts(folder: Path) -> dict[tuple[str, str], set[str]]:
    """Return by folder and name of each part the keys of which it has the last result."""
    found: dict[tuple[str, str], set[str]] = {}
    known: set[str] = set()
    for path in reversed(_parts(folder, "recordings")):
        keys = set(_table(path, TABLES["recordings"])["key"].to_pylist()) - known
        known |= keys
        found[path.parent.name, path.name] = keys
    return found


def read(folder: Path, table: str) -> list[DatasetRow]:
    """Read the rows of a table of a dataset, the oldest parts first, or of one of its single files.

    Of what was computed twice the last counts: a key comes once in ``recordings``. A text is never missing.

    Raises
    ------
    StoreError
        If a part is damaged, or what it holds can't be of such a dataset.
    """
    if table in _FILES:
        path = folder / f"{table}.parquet"
        return _table(path, _FILES[table]).to_pylist() if path.exists() else []
    keys = _keys_of_parts(folder)
    rows: list[DatasetRow] = []
    for path in _parts(folder, table):
        own = keys.get((path.parent.name, path.name), set())
        command = {"command": path.parent.name.removeprefix(RESULTS)}
        for row in _table(path, TABLES[table]).to_pylist():
            if row["key"] in own:
                rows.append(row | command)
                own -= {row["key"]} if table == "recordings" else set()
    return rows


def _table(path: Path, schema: pa.Schema) -> pa.Table:
    """Read a part, whoever wrote it."""
    try:
        with open_regular(path) as file, pa.parquet.ParquetFile(file) as part:
            require_cells(path, part.metadata.num_rows * max(part.metadata.num_columns, 1))
            held = part.read([name for name in schema.names if name in part.schema_arrow.names])
        held.validate(full=True)  # texts that are no UTF-8, for one
        table = pa.Table.from_arrays([_column(held, field) for field in schema], schema=schema)
        if schema in TABLES.values() and "" in table["key"].to_pylist():
            raise ValueError("a row without a key")
        if "n_recordings" in schema.names and not all((n or 0) > 0 for n in table["n_recordings"].to_pylist()):
            raise ValueError("a row of no recording")
        return table
    except (pa.ArrowException, OSError, ValueError, KeyError, RecordingError) as error:
        said = "; ".join(getattr(error, "problems", ())) or str(error)
        raise StoreError(
            path, f"expected a part of a dataset of hil fleet, got a damaged one: {said}. Move it away, and call "
            "again: what it held is computed again."
        ) from error  # fmt: skip


def _column(held: pa.Table, field: pa.Field) -> pa.ChunkedArray:
    """Return a column as the schema has it: texts that are missing are empty, numbers that are none are missing."""
    if field.name in held.column_names:
        column = held[field.name].cast(field.type)
    else:
        column = pa.chunked_array([pa.nulls(held.num_rows, field.type)])
    if field.type == pa.string():
        column = pa.compute.fill_null(column, "")
    elif field.type == pa.float64():
        is_number = pa.compute.less(pa.compute.abs(column), LARGEST)  # NaN is not less, either
        column = pa.compute.if_else(is_number, column, pa.scalar(None, pa.float64()))
    return column


def require_dataset(folder: Path) -> None:
    """Refuse a folder that is no dataset."""
    if not (folder / "recordings").is_dir():
        raise UsageError(f"{folder}: expected a dataset that hil fleet diagnose or identify wrote, got none")
