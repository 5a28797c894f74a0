"""Scales that do not fit a model, or that a recording shows by itself, named with the line that cures them.

The line is one of ``[signals]``: the factor that was found, times the scale that counts.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from estimator.diagnosis.acquisition.chain import as_if_not_lost
from estimator.diagnosis.preconditions.explanations import are_whole_numbers
from estimator.diagnosis.preconditions.prepare import require_plausible
from estimator.diagnosis.preconditions.units import require_plausible_alone
from estimator.errors import Cure, EstimatorError, Implausible
from estimator.physics.model import DrivelineModel
from estimator.signals.record import OutputKind, Record
from hil.errors import RecordingError
from hil.recording.formats import read_table
from hil.recording.scales import Role, scale_of
from hil.recording.signals import Tell, time_signal
from hil.recording.signals_config import OutputSignal, SignalsConfig, TorqueSignal
from hil.recording.table import Table


def tell_scales(
    records: Sequence[Record],
    paths: Sequence[Path],
    model: DrivelineModel,
    signals: SignalsConfig | None,
    dbc: Path | None,
    tell: Tell,
) -> None:
    """Tell of torque, output or time that is off by a factor or in sign, as ``hil diagnose`` refuses it."""
    try:
        implausible = require_plausible(records, model)
    except Implausible as error:
        implausible = [error]
    except EstimatorError:
        return  # whatever else is wrong with a recording, who uses it says so
    for each in implausible:
        add_the_line_to_write(each, paths, signals, dbc)
        tell(" ".join((str(each), *getattr(each, "__notes__", ()))))


def tell_scales_alone(record: Record, path: Path, signals: SignalsConfig | None, dbc: Path | None, tell: Tell) -> None:
    """Tell of columns that are swapped, or off in sign or by a unit, as a recording shows it by itself."""
    try:
        with with_the_line_to_write([path], signals, dbc):
            require_plausible_alone(*as_if_not_lost([record]))
    except Implausible as error:
        tell(" ".join((str(error), *getattr(error, "__notes__", ()))))
    if are_whole_numbers(record):
        known = signals or SignalsConfig()
        lines = cure_lines(Cure(record.name, torque=1e-3), known, read_table(path, known.request(dbc)))
        tell(
            f"recording {record.name}: the torques are whole numbers. If they are per mille of the rated torque, as "
            f"drives send them, write in [signals], each scale times the rated torque in Nm: {'  '.join(lines)}"
        )


@contextmanager
def with_the_line_to_write(
    paths: Sequence[Path], signals: SignalsConfig | None, dbc: Path | None = None
) -> Iterator[None]:
    """Add to a refusal the lines of ``[signals]`` that cure it."""
    try:
        yield
    except Implausible as error:
        add_the_line_to_write(error, paths, signals, dbc)
        raise


def add_the_line_to_write(
    error: Implausible, paths: Sequence[Path], signals: SignalsConfig | None, dbc: Path | None
) -> None:
    """Add the lines of ``[signals]`` that cure a recording, where that is known, as a note."""
    cure = error.cure
    path = None if cure is None else next((path for path in paths if path.stem == cure.recording), None)
    if cure is not None and path is not None:
        known = signals or SignalsConfig()
        with suppress(RecordingError):  # the file has changed since it was read
            table = read_table(path, known.request(dbc))
            error.add_note("In [signals] write: " + "  ".join(cure_lines(cure, known, table)))


def cure_lines(cure: Cure, signals: SignalsConfig, table: Table) -> list[str]:
    """Return the lines that a ``[signals]`` table has to have instead of its own."""
    torques, (kind, output) = signals.torques(), signals.output()
    kind = kind if cure.kind is None else OutputKind(cure.kind)
    time = time_signal(table, signals.time)
    if cure.swapped is not None:
        swapped = torques[cure.swapped]
        torques = [*torques[: cure.swapped], TorqueSignal(column=output.column), *torques[cure.swapped + 1 :]]
        lines = [_torque_line(torques, [None] * len(torques))]
        return [*lines, f"{kind.value} = {_entry(swapped.column, None, f', at = {_quoted(output.at.value)}')}"]
    lines = []
    if cure.torque != 1.0:
        inputs = cure.inputs or tuple(range(len(torques)))
        scales = [_scale(table, torque, Role.TORQUE) for torque in torques]
        lines.append(_torque_line(torques, [s * cure.torque if k in inputs else s for k, s in enumerate(scales)]))
    if cure.output != 1.0 or cure.kind is not None:
        scale = (1.0 if cure.kind else _scale(table, output, Role(kind.value))) * cure.output
        lines.append(f"{kind.value} = {_entry(output.column, scale, f', at = {_quoted(output.at.value)}')}")
    if cure.time != 1.0 and time.column is not None:
        scale = scale_of(table, time.column, Role.TIME, time.given_scale) * cure.time
        lines.append(f"time = {_entry(time.column, scale)}")
    elif cure.time != 1.0 and time.sample_time_s is not None:
        lines.append(f"time = {{ sample_time_s = {time.sample_time_s * cure.time:.6g} }}")
    return lines


def _scale(table: Table, signal: TorqueSignal | OutputSignal, role: Role) -> float:
    return scale_of(table, signal.column, role, signal.given_scale)


def _torque_line(torques: Sequence[TorqueSignal], scales: Sequence[float | None]) -> str:
    entries = [_entry(torque.column, scale) for torque, scale in zip(torques, scales, strict=True)]
    return f"torque = [ {', '.join(entries)} ]"


def _entry(column: str, scale: float | None, more: str = "") -> str:
    number = "" if scale in (None, 1.0) else f", scale = {scale:.6g}"
    return f"{{ column = {_quoted(column)}{number}{more} }}"


def _quoted(text: Any) -> str:
    return json.dumps(str(text), ensure_ascii=False)
