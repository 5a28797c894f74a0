"""Scales that do not fit a model, reported with the line that cures them where nothing is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from estimator.diagnosis.acquisition import as_if_not_lost
from estimator.diagnosis.preconditions import require_plausible_units
from estimator.errors import EstimatorError, Implausible
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from hil.recording.cure import with_the_line_to_write
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
