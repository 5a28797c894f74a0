"""Scales that do not fit a model, or that a recording shows by itself, named with the line that cures them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from estimator.diagnosis.acquisition import as_if_not_lost
from estimator.diagnosis.preconditions import are_whole_numbers, require_plausible_alone, require_plausible_units
from estimator.errors import Cure, EstimatorError, Implausible
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from hil.recording.cure import cure_lines, with_the_line_to_write
from hil.recording.formats import read_table
from hil.recording.signals import Tell
from hil.recording.signals_config import SignalsConfig


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
        with with_the_line_to_write(paths, signals, dbc):
            require_plausible_units(as_if_not_lost(records), model)
    except Implausible as error:
        tell(" ".join((str(error), *getattr(error, "__notes__", ()))))
    except EstimatorError:
        pass  # a recording that can't tell its scales; whatever else is wrong with it, who uses it says so


PER_MILLE = 1e-3


def tell_scales_alone(record: Record, path: Path, signals: SignalsConfig | None, dbc: Path | None, tell: Tell) -> None:
    """Tell of columns that are swapped, or off in sign or by a unit, as a recording shows it by itself."""
    try:
        with with_the_line_to_write([path], signals, dbc):
            require_plausible_alone(*as_if_not_lost([record]))
    except Implausible as error:
        tell(" ".join((str(error), *getattr(error, "__notes__", ()))))
    if are_whole_numbers(record):
        known = signals or SignalsConfig()
        lines = cure_lines(Cure(record.name, torque=PER_MILLE), known, read_table(path, known.request(dbc)))
        tell(
            f"recording {record.name}: the torques are whole numbers. If they are per mille of the rated torque, as "
            f"drives send them, write in [signals], each scale times the rated torque in Nm: {'  '.join(lines)}"
        )
