"""The model that ``hil diagnose`` questions, a model file or an FMU, and the recordings as it reads them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from estimator.physics.parallel import TimeIsUp, Work, counted
from estimator.signals.record import Record
from hil.config.model_file import ModelFile, read_model_for_recordings, read_signals
from hil.errors import UsageError
from hil.plants.fmu_line import fmu_line
from hil.plants.fmu_plant import FmuPlant, is_fmu
from hil.plants.plant import Trust
from hil.recording import read_records
from hil.recording.signals import Tell


@dataclass(frozen=True, slots=True)
class Asked:
    """What was given on the command line."""

    model: Path
    signals: Path | None  # file with the ``[signals]`` that recordings are read by
    mapped: Sequence[str]  # variables of an FMU (``names``)
    trust: Trust
    budget_s: float | None = None  # time that an FMU's first simulations may take, too [s]


def questioned(
    asked: Asked, recordings: Sequence[Path], dbc: Path | None, tell: Tell
) -> tuple[ModelFile, tuple[Record, ...]]:
    """Read a model and recordings."""
    if is_fmu(asked.model):
        fmu = FmuPlant(asked.model, asked.mapped, asked.trust.fmu)
        signals = None if asked.signals is None else read_signals(asked.signals)
        records = read_records(recordings, signals, False, dbc, tell)
        if any(record.channels for record in records):
            raise UsageError(f"{asked.signals}: expected one output with an FMU. Take outputs out of [signals]")
        try:
            with counted(Work(math.inf if asked.budget_s is None else asked.budget_s)):
                return ModelFile(fmu_line(fmu, records), signals), records
        except TimeIsUp:
            raise UsageError(
                f"{asked.model}: expected an FMU that simulates the recordings once in {asked.budget_s:g} s "
                "(--budget-s), got one that does not. Give it more time, fewer or shorter recordings; one that hangs "
                "is to be repaired in the program that made it."
            ) from None
    if asked.signals is not None:
        raise UsageError(f"--signals {asked.signals}: expected with an FMU; a model file has its own [signals]")
    if asked.mapped:
        raise UsageError(f"--map {asked.mapped[0]}: expected with an FMU; {asked.model} is a model file")
    file = read_model_for_recordings(asked.model, asked.trust.laws)
    return file, read_records(recordings, file.signals, file.on_bench, dbc, tell)
