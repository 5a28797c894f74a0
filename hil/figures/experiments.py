"""The set of experiments the figures are made of: driven now on the simulated rig, or recorded before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from estimator.identification.identify import identify
from estimator.identification.settings import Settings
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from hil.figures.local_model import TRUTH, LocalModel, Reference
from hil.figures.road.conditions import draw_conditions
from hil.figures.road.drive import Driven, drive
from hil.recording import read_record
from hil.rig.drive import Progress
from hil.rig.stop import StopRequest


def drive_all(
    folder: Path,
    seed: int,
    count: int,
    duration_s: float,
    stop: StopRequest,
    progress: Callable[[int], Progress] = lambda number: lambda phase, time_s: None,
) -> list[Driven]:
    """Drive ``count`` experiments of one seed, ``run_1.csv`` and on."""
    conditions = draw_conditions(seed, count)
    return [
        drive(folder / f"run_{number + 1}.csv", each, duration_s, stop, progress(number))
        for number, each in enumerate(conditions)
    ]


def driven_models(driven: Sequence[Driven], settings: Settings) -> list[LocalModel]:
    """Identify from every experiment that was driven; the truth goes along."""
    models = []
    for each in driven:
        record = read_record(each.path)
        models.append(LocalModel(record, identify(record, settings), Reference(TRUTH, each.line)))
    return models


def recorded_models(
    records: Sequence[Record], settings: Settings, expected: DrivelineModel | None = None
) -> list[LocalModel]:
    """Identify from recordings; next to them what a two-mass model file expects."""
    return [LocalModel.with_expected(record, identify(record, settings), expected) for record in records]
