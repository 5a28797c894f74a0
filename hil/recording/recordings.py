"""The recordings of one command, read together: all at fault are reported, and they must fit together."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from estimator.errors import made_of_each
from estimator.signals.record import Record
from hil.errors import InputError, RecordingError, UsageError
from hil.files import parse_json
from hil.printable import printable
from hil.recording import columns
from hil.recording.checksum import CHECKSUM, RIG_CHECKSUM, RIG_TEXT, SAID, require_unchanged
from hil.recording.description import read_sidecar
from hil.recording.formats import format_of, read_metadata, read_table
from hil.recording.own_csv import Extent, data_sha256_at, extent, is_own
from hil.recording.signals import Tell, read_record
from hil.recording.signals_config import SignalsConfig
from hil.recording.table import Table

CSV = ".csv"

_SHOWN = 16
"""Digits of a checksum that are shown: enough to distinguish any two that a person will ever compare."""

_SINGLE_LINE = 100

# A single late or missing sample is flagged and left out. That does not help where hardly a stretch between two of them
# is whole: the torque of a flagged sample is held, wrong by a step of the PRBS half of the time. With one bad cycle in
# 20 a stretch is 20 cycles long on average, which the default model (four coefficients at twice the period) needs twice
# over to forget where it began. A diagnosis refuses nothing: the acquisition is among what it looks into.
WORST_SHARE = 0.05  # part of the cycles that may have been late, missing or without an answer


def read_records(
    paths: Sequence[Path],
    signals: SignalsConfig | None = None,
    on_bench: bool = False,
    dbc: Path | None = None,
    tell: Tell | None = None,
) -> tuple[Record, ...]:
    """Read recordings that are to be explained by one model; see :func:`read_record` for the arguments.

    Refuses two of one name, by which results are reported; of the same samples, which would count twice as evidence and
    prove nothing held out; and of different sampling periods. Where several can't be read, all faults are said.
    """
    _require_own_names(paths)
    records = made_of_each(
        paths, lambda path: read_record(path, signals, on_bench, dbc, tell), RecordingError, InputError
    )
    _require_one_period(paths, records)
    _require_own_samples(paths, records)
    return tuple(records)


def _require_own_names(paths: Sequence[Path]) -> None:
    names: dict[str, Path] = {}
    for path in paths:
        if path.stem in names:
            raise UsageError(
                f"{path}: expected recordings of different names, got {path.stem!r} twice "
                f"(also {names[path.stem]}). Rename one, or give it once."
            )
        names[path.stem] = path


def _require_one_period(paths: Sequence[Path], records: Sequence[Record]) -> None:
    for path, record in zip(paths, records, strict=True):
        if abs(record.sample_time_s - records[0].sample_time_s) > 1e-6 * records[0].sample_time_s:
            raise RecordingError(
                path,
                f"expected the sampling period of {paths[0]}, {records[0].sample_time_s:g} s, "
                f"got {record.sample_time_s:g} s. Give recordings of one period.",
            )


def _require_own_samples(paths: Sequence[Path], records: Sequence[Record]) -> None:
    known: dict[tuple[bytes, bytes], Path] = {}
    for path, record in zip(paths, records, strict=True):
        samples = (record.torque_nm.tobytes(), record.output.tobytes())
        if samples in known:
            raise UsageError(
                f"{path}: expected samples of its own, got those of {known[samples]}, every one the same. "
                "Give each recording once; hold out one that was not used."
            )
        known[samples] = path


class Facts(NamedTuple):
    """What is known of a recording whose rows are not kept."""

    metadata: Mapping[str, str]  # what it says of itself
    extent: Extent  # rows, times and flags


def facts_of(table: Table) -> Facts:
    """Return the facts of a table; without columns for them, times and flags count as 0."""
    there = table.numeric([name for name in (columns.TIME, columns.FLAGS) if name in table.columns])
    time_s = there.get(columns.TIME, np.zeros(1))
    flagged = int(np.count_nonzero(there[columns.FLAGS])) if columns.FLAGS in there else 0
    return Facts(table.metadata, Extent(table.n_rows, float(time_s[0]), float(time_s[-1]), flagged))


def read_facts(path: Path) -> Facts:
    """Read a recording once, in memory that does not grow where it is a CSV of this rig, and return its facts."""
    format_of(path)
    if path.suffix.lower() == CSV and is_own(path) and (said := read_sidecar(path)).found and not said.types:
        try:
            held = extent(path)
            require_unchanged(path, said.metadata, said.units, lambda: data_sha256_at(path, held.n_rows))
        except ValueError:  # changed by hand: the reader of all forms of text says where
            return facts_of(read_table(path))
        if held.n_rows:
            return Facts(said.metadata, held)
    return facts_of(read_table(path))


def self_description(metadata: Mapping[str, str]) -> list[str]:
    """Return a line for each thing that is said; long texts by their length, the rig file by its checksum."""
    if not metadata:
        return ["no metadata: no units, no rig file, no checksum"]
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


def require_even_cycles(paths: Iterable[Path]) -> None:
    """See that the runs that left a timing record kept their cycles; a recording without one passes."""
    made_of_each(paths, _require_even, RecordingError, InputError)


def _require_even(path: Path) -> None:
    metadata = read_metadata(path)
    if "timing" not in metadata:
        return
    try:
        timing = parse_json(metadata["timing"])
        cycles, missed = int(timing["cycles"]), int(timing["missed"])
        late, unanswered = int(timing["late"]), int(timing["unanswered"])
    except (ValueError, TypeError, KeyError) as error:
        raise RecordingError(
            path, f"metadata timing: expected a record hil.timing/1, got one that can't be read ({error!r})"
        ) from error
    bad, due = missed + late + unanswered, cycles + missed
    if bad > WORST_SHARE * due:
        raise RecordingError(
            path,
            f"expected at most {WORST_SHARE:.0%} of the cycles late or incomplete, got {bad / due:.0%} of {due}: "
            f"{missed} missed, {late} late by more than half a period, {unanswered} answers missing. Record again "
            "on a machine that is less busy or grants real-time scheduling, or at a longer period.",
        )


def rig_of(paths: Iterable[Path]) -> str:
    """Return the name of the rig that recordings are of, as they say themselves; "" where none does."""
    for path in paths:
        said = read_metadata(path).get(RIG_TEXT, "") if format_of(path).metadata is not None else ""
        try:
            name = tomllib.loads(said).get("name")
        except tomllib.TOMLDecodeError:  # another program's key of that name
            continue
        if isinstance(name, str):
            return printable(name)
    return ""
