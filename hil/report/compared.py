"""Models against recordings: each model's recordings as it wants them, simulated, and the errors measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from estimator.diagnosis.preconditions.channels import with_usable_channels
from estimator.signals.record import Record
from hil.config.model_file import ModelFile, read_model_for_recordings
from hil.config.model_tables import Prepared
from hil.errors import UsageError
from hil.plants.fmu_plant import FmuPlant, is_fmu
from hil.plants.plant import ModelPlant, Plant
from hil.plants.prepared import known_events, prepare_again
from hil.plants.scales import tell_scales
from hil.plants.trust import Trust
from hil.recording import read_records
from hil.recording.signals import Tell
from hil.report.comparison import Comparison, compare_record


def compared(
    models: Sequence[Path],
    recordings: Sequence[Path],
    mapped: Sequence[str],
    trust: Trust,
    dbc: Path | None,
    tell: Tell,
) -> list[list[Comparison]]:
    """Return the comparisons of each model, a list per recording.

    The recordings are read by the first model file's ``[signals]`` and prepared as the first says that was made by a
    diagnosis: all models are held against the same samples.

    Raises
    ------
    UsageError, ModelFileError, RecordingError
        For what can't be read, is not trusted, or does not fit together.
    """
    _require_own_names(models)
    files = {path: read_model_for_recordings(path, trust.laws) for path in models if not is_fmu(path)}
    reads = next(iter(files.values()), None)
    signals, on_bench = (None, False) if reads is None else (reads.signals, reads.on_bench)
    prepared: Prepared | None = next((file.prepared for file in files.values() if file.prepared is not None), None)
    read = read_records(recordings, signals, on_bench, dbc, tell)
    if reads is not None:
        tell_scales(read, recordings, reads.model, signals, dbc, tell)
    records, unusable = with_usable_channels(prepare_again(read, prepared, tell))
    for line in unusable:
        tell(line)
    by_model = [_of_model(path, files.get(path), records, recordings, mapped, trust) for path in models]
    return [list(of_recording) for of_recording in zip(*by_model, strict=True)]


def _of_model(
    path: Path,
    file: ModelFile | None,
    records: Sequence[Record],
    recordings: Sequence[Path],
    mapped: Sequence[str],
    trust: Trust,
) -> list[Comparison]:
    plant: Plant
    if file is None:
        plant = FmuPlant(path, mapped, trust.fmu)
    else:
        if file.laws:
            read_model_for_recordings(path, trust.laws)  # its laws in place of those of the model read after it
        plant = ModelPlant(path.name, file.model, known_events(file.prepared, recordings))
    return [compare_record(plant, record) for record in records]


def _require_own_names(models: Sequence[Path]) -> None:
    names = [path.name for path in models]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UsageError(f"--model {twice}: expected models of different file names, got it twice. Rename one.")
