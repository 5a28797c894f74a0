"""What recordings and model leave doubtful, in the same words for every command, with the line that cures it.

The line is one of ``[signals]``: the factor that was found, times the scale that counts.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from estimator.diagnosis.preconditions.channels import standstill, with_motion_corrected
from estimator.diagnosis.preconditions.odds import are_whole_numbers
from estimator.diagnosis.preconditions.plausible import doubtful
from estimator.diagnosis.result import Diagnosis, Doubt
from estimator.errors import Cure, EstimatorError, Implausible
from estimator.physics.model import DrivelineModel
from estimator.signals.record import OutputKind, Record
from hil.errors import RecordingError
from hil.recording.formats import read_table
from hil.recording.scales import Role, scale_of
from hil.recording.signals import Tell, time_signal
from hil.recording.signals_config import OutputSignal, SignalsConfig, TorqueSignal
from hil.recording.table import Table


def tell_doubts(
    records: Sequence[Record],
    paths: Sequence[Path],
    model: DrivelineModel | None,
    signals: SignalsConfig | None,
    dbc: Path | None,
    tell: Tell,
) -> None:
    """Tell what is doubtful of recordings, and of their model where there is one, as ``hil diagnose`` has it."""
    for note in (*with_motion_corrected(records)[1], *filter(None, map(standstill, records))):
        tell(note)
    try:
        doubts = doubtful(records, model)
    except Implausible as error:
        doubts = [Doubt("", str(error), 1.0, cure=error.cure)]
    except EstimatorError:
        return  # whatever else is wrong with a recording, who uses it says so
    for doubt in doubts:
        tell(_with_line(doubt.statement, doubt.cure, paths, signals, dbc))
    if model is None and not doubts and are_whole_numbers(records[0]):
        known = signals or SignalsConfig()
        lines = cure_lines(Cure(records[0].name, torque=1e-3), known, read_table(paths[0], known.request(dbc)))
        tell(
            f"recording {records[0].name}: the torques are whole numbers. If they are per mille of the rated torque, "
            f"as drives send them, write in [signals], each scale times the rated torque in Nm: {'  '.join(lines)}"
        )


@contextmanager
def with_the_line_to_write(
    paths: Sequence[Path], signals: SignalsConfig | None, dbc: Path | None = None
) -> Iterator[None]:
    """Add to a refusal the lines of ``[signals]`` that cure it."""
    try:
        yield
    except Implausible as error:
        if line := line_to_write(error.cure, paths, signals, dbc):
            error.add_note(f"In [signals] write: {line}")
        raise


def with_lines(
    diagnosis: Diagnosis, paths: Sequence[Path], signals: SignalsConfig | None, dbc: Path | None = None
) -> Diagnosis:
    """Return a diagnosis whose doubts have the lines that cure them."""
    doubts = [replace(each, line=line_to_write(each.cure, paths, signals, dbc)) for each in diagnosis.doubts]
    return replace(diagnosis, doubts=tuple(doubts))


def _with_line(
    text: str, cure: Cure | None, paths: Sequence[Path], signals: SignalsConfig | None, dbc: Path | None
) -> str:
    line = line_to_write(cure, paths, signals, dbc)
    return f"{text} In [signals] write: {line}" if line else text


def line_to_write(
    cure: Cure | None, paths: Sequence[Path], signals: SignalsConfig | None, dbc: Path | None = None
) -> str:
    """Return the lines of ``[signals]`` that cure a recording; empty where none are known."""
    path = None if cure is None else next((path for path in paths if path.stem == cure.recording), None)
    if cure is not None and path is not None:
        known = signals or SignalsConfig()
        with suppress(RecordingError):  # the file has changed since it was read
            return "  ".join(cure_lines(cure, known, read_table(path, known.request(dbc))))
    return ""


def cure_lines(cure: Cure, signals: SignalsConfig, table: Table) -> list[str]:
    """Return the lines that a ``[signals]`` table has to have instead of its own."""
    torques, (kind, output) = signals.torques(), signals.output()
    kind = kind if cure.kind is None else OutputKind(cure.kind)
    time = time_signal(table, signals.time)
    if cure.swapped is not None:
        swapped = torques[cure.swapped]
        torques = [*torques[: cure.swapped], TorqueSignal(column=output.column), *torques[cure.swapped + 1 :]]
        lines = [_torque_line(torques, None)]
        return [*lines, f"{kind.value} = {_entry(swapped.column, None, f', at = {_quoted(output.at.value)}')}"]
    if cure.columns:
        added = [TorqueSignal(column=each) for each in cure.columns]
        return [_torque_line([*([] if cure.is_instead else torques), *added], None)]
    if cure.dropped is not None:
        return [_torque_line([each for k, each in enumerate(torques) if k != cure.dropped], None)]
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


def _torque_line(torques: Sequence[TorqueSignal], scales: Sequence[float] | None) -> str:
    """Return the line of the inputs with these scales; without any, each with that which it was given."""
    given = [torque.given_scale for torque in torques] if scales is None else scales
    entries = [_entry(torque.column, scale) for torque, scale in zip(torques, given, strict=True)]
    return f"torque = [ {', '.join(entries)} ]"


def _entry(column: str, scale: float | None, more: str = "") -> str:
    number = "" if scale in (None, 1.0) else f", scale = {scale:.6g}"
    return f"{{ column = {_quoted(column)}{number}{more} }}"


def _quoted(text: Any) -> str:
    return json.dumps(str(text), ensure_ascii=False)
