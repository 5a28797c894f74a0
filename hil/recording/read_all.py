"""The recordings of one command, read together: all at fault are reported, and they must fit together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from estimator.signals.record import Record
from hil.errors import InputError, RecordingError, UsageError
from hil.recording.signals import Tell, read_record
from hil.recording.signals_config import SignalsConfig


def read_records(
    paths: Sequence[Path],
    signals: SignalsConfig | None = None,
    on_bench: bool = False,
    dbc: Path | None = None,
    tell: Tell | None = None,
) -> tuple[Record, ...]:
    """Read recordings that are to be explained by one model; see :func:`read_record` for the arguments.

    Raises
    ------
    UsageError
        If two have the same name: results are reported by it; or the same samples: they would count twice as
        evidence, and held out they would prove nothing.
    RecordingError
        If one can't be read, or has another sampling period than the first.
    InputError
        If several can't be read; with the faults of each.
    """
    _require_own_names(paths)
    records: list[Record] = []
    errors: list[RecordingError] = []
    for path in paths:
        try:
            records.append(read_record(path, signals, on_bench, dbc, tell))
        except RecordingError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise InputError("\n".join(str(error) for error in errors))
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
