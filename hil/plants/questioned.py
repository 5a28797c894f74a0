"""The model that ``hil diagnose`` questions, a model file or an FMU, and the recordings as it reads them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from estimator.diagnosis.first_use import COMPILING, compile_kernels, is_first_use
from estimator.physics.parallel import TimeIsUp, Work, counted
from estimator.signals.record import Record
from hil.config.model_file import ModelFile, read_model_for_recordings, read_signals
from hil.errors import UsageError
from hil.plants.fmu_line import FmuLine, fmu_line
from hil.plants.fmu_plant import FmuPlant, is_fmu
from hil.plants.fmu_tune import tolerances
from hil.plants.plant import ModelPlant, Plant, Trust
from hil.plants.prepared import known_events, prepare_again
from hil.recording import read_records
from hil.recording.signals import Tell
from hil.recording.signals_config import SignalsConfig


@dataclass(frozen=True, slots=True)
class GivenInput:
    """What was given on the command line."""

    model: Path  # a model file or an FMU
    signals: Path | None  # file with the ``[signals]`` that recordings are read by
    mapped: Sequence[str]  # variables of an FMU (``names``)
    trust: Trust  # what code may run
    tuned: Sequence[str] = ()  # parameters of an FMU with what they are trusted to (``tolerances``)
    budget_s: float | None = None  # time that all simulations of an FMU may take [s]


@dataclass(frozen=True, slots=True)
class DiagnosisInput:
    """A model and recordings; of an FMU, what is questioned in its place."""

    file: ModelFile  # in the place of an FMU, what simulates it and the [signals] that were given
    records: tuple[Record, ...]  # in the order in which they were given
    fmu: FmuLine | None = None  # None for a model file


@contextmanager
def questioned(asked: GivenInput, recordings: Sequence[Path], dbc: Path | None, tell: Tell) -> Iterator[DiagnosisInput]:
    """Read a model and recordings, and find what is questioned in the place of an FMU, which its budget ends."""
    if not is_fmu(asked.model):
        yield DiagnosisInput(*_of_model_file(asked, recordings, dbc, tell))
        return
    tuned = tolerances(asked.tuned)
    fmu, signals, records = _of_fmu(asked, recordings, dbc, tell)
    for masses in (1, 2):  # of the lines that are fitted to it; compiling does not count
        if is_first_use(masses):
            tell(COMPILING)
            compile_kernels(masses)
    try:
        with counted(Work(math.inf if asked.budget_s is None else asked.budget_s)):
            line = fmu_line(fmu, records, tuned)
            yield DiagnosisInput(ModelFile(line.model, signals), records, line)
    except TimeIsUp:
        raise UsageError(
            f"{asked.model}: expected an FMU of which load and initial state are found in {asked.budget_s:g} s "
            "(--budget-s), got one that takes longer. Give it more time, fewer or shorter recordings; one that hangs "
            "is to be repaired in the program that made it."
        ) from None


def simulated_by(asked: GivenInput, recording: Path, dbc: Path | None, tell: Tell) -> tuple[Plant, Record]:
    """Read what simulates a recording, and the recording with all its rows."""
    if is_fmu(asked.model):
        fmu, _, (record,) = _of_fmu(asked, [recording], dbc, tell)
        return fmu, record
    file, records = _of_model_file(asked, [recording], dbc, tell)
    (record,) = prepare_again(records, file.prepared, tell, keep_rows=True)
    return ModelPlant(asked.model.name, file.model, known_events(file.prepared, [recording])), record


def _of_fmu(
    asked: GivenInput, recordings: Sequence[Path], dbc: Path | None, tell: Tell
) -> tuple[FmuPlant, SignalsConfig | None, tuple[Record, ...]]:
    fmu = FmuPlant(asked.model, asked.mapped, asked.trust.fmu)
    signals = None if asked.signals is None else read_signals(asked.signals)
    records = read_records(recordings, signals, False, dbc, tell)
    if any(record.channels for record in records):
        raise UsageError(f"{asked.signals}: expected one output with an FMU. Take outputs out of [signals]")
    return fmu, signals, records


def _of_model_file(
    asked: GivenInput, recordings: Sequence[Path], dbc: Path | None, tell: Tell
) -> tuple[ModelFile, tuple[Record, ...]]:
    if asked.signals is not None:
        raise UsageError(f"--signals {asked.signals}: expected with an FMU; a model file has its own [signals]")
    for option, given in (("--map", asked.mapped), ("--tune", asked.tuned)):
        if given:
            raise UsageError(f"{option} {given[0]}: expected with an FMU; {asked.model} is a model file")
    file = read_model_for_recordings(asked.model, asked.trust.laws)
    return file, read_records(recordings, file.signals, file.on_bench, dbc, tell)
