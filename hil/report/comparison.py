"""Recordings against their free-run simulations, in figures; each measured output by itself."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from estimator.diagnosis.preconditions.channels import with_usable_channels
from estimator.identification.offline.validation import CorrelationTest, residual_tests
from estimator.physics.model import Motion
from estimator.signals.decimate import block_of
from estimator.signals.record import FloatArray, OutputKind, Record, separated_outputs
from hil.config.model_file import ModelFile, read_model_for_recordings
from hil.config.model_tables import Prepared
from hil.errors import UsageError
from hil.plants.fmu_plant import FmuPlant, is_fmu
from hil.plants.plant import ModelPlant, Plant, Trust
from hil.plants.prepared import known_events, prepare_again
from hil.plants.scales import tell_doubts
from hil.provenance import Provenance
from hil.recording import read_records
from hil.recording.signals import Tell
from hil.report.numbers import fields_as_json, json_number, shown
from hil.report.wording import output_unit

SCHEMA = "hil.compare/1"


@dataclass(frozen=True, slots=True)
class Comparison:
    """One output of a recording, its simulation by one model, and how far they differ."""

    model: str  # name of the model
    motion: Motion  # of the model
    record: Record  # the recording
    simulated: FloatArray  # (N,): In ``unit``
    unit: str  # of the output and of its errors
    rms: float  # of the error over the samples that count
    largest: float  # magnitude of the error over the samples that count
    load_torque: float  # constant load torque that was estimated [Nm; translation N]
    fit_percent: float  # 100 (1 - norm of the error / norm of the output without its mean), the NRMSE fit
    past_input: CorrelationTest  # of the error and torques before it
    itself: CorrelationTest  # of the error and its own past
    further: tuple[Comparison, ...] = ()  # those of the recording's further outputs that the model simulates
    beyond: tuple[str, ...] = ()  # sentences on what the simulation is no longer to be believed for

    @property
    def outputs(self) -> tuple[Comparison, ...]:
        """Those of all outputs, the recording's own first."""
        return (self, *self.further)

    @property
    def error(self) -> FloatArray:
        """Measured minus simulated, shape (N,); NaN where a sample does not count."""
        return np.where(self.record.okay, self.record.output - self.simulated, np.nan)


def compare_record(plant: Plant, record: Record) -> Comparison:
    """Simulate a recording and measure the error of each output; one that a plant does not simulate is left out."""
    run = plant.run(record)
    views = separated_outputs([record], lambda _: 1.0)[1:]
    load = run.start.load_torque_nm
    pairs = zip(views, run.further, strict=True) if run.further else ()
    further = tuple(_compared(plant, view, _from_its_zero(view, found), load) for view, found in pairs)
    return replace(_compared(plant, record, run.output, load), further=further, beyond=run.beyond)


def _from_its_zero(record: Record, simulated: FloatArray) -> FloatArray:
    """Return a further output as simulated; an angle from its sensor's own zero, which nothing else tells."""
    if record.kind is not OutputKind.POSITION:
        return simulated
    return simulated + float(np.mean((record.output - simulated)[record.okay]))


def _compared(plant: Plant, record: Record, simulated: FloatArray, load_torque: float) -> Comparison:
    okay = record.okay
    error = record.output - simulated
    block = block_of(record.sample_time_s)
    if okay.size < block:
        raise UsageError(
            f"recording {record.name}: expected {block * record.sample_time_s:g} s at least, got "
            f"{okay.size * record.sample_time_s:.3g} s, a row every {record.sample_time_s:.3g} s. Is its time in "
            "another unit? In [signals], time = { column = ..., scale = 86400.0 } reads days."
        )
    past_input, _, itself = residual_tests(error, record, block)
    spread = float(np.std(record.output[okay]))
    rms = float(np.sqrt(np.mean(error[okay] ** 2)))
    return Comparison(
        plant.name,
        plant.motion,
        record,
        simulated,
        output_unit(record.kind, plant.motion),
        rms,
        float(np.max(np.abs(error[okay]))),
        load_torque,
        100.0 * (1.0 - rms / spread) if spread > 0 else float("nan"),
        past_input,
        itself,
    )


def by_output(comparisons: Sequence[Comparison]) -> dict[str, list[Comparison]]:
    """Return those of several recordings by output: the first one's under an empty name, then each further one's."""
    found: dict[str, list[Comparison]] = {"": []}
    for each in (output for comparison in comparisons for output in comparison.outputs):
        found.setdefault(each.record.label, []).append(each)
    return found


def together(comparisons: Sequence[Comparison]) -> float:
    """Return the RMS of the error over all samples of several recordings, as ``hil diagnose`` gives it."""
    squares = sum(each.rms**2 * int(each.record.okay.sum()) for each in comparisons)
    return float(np.sqrt(squares / sum(int(each.record.okay.sum()) for each in comparisons)))


def shown_error(value: float, each: Comparison, unit_above: str) -> str:
    """Return an error in words, with its unit where that is not the one above its column."""
    return shown(value) if each.unit == unit_above else shown(value, each.unit)


def comparison_text(comparisons: Sequence[Sequence[Comparison]], made: Provenance | None = None) -> str:
    """Return the figures as JSON text: ``recordings`` are those of the first model."""
    by_model = list(zip(*comparisons, strict=True))
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "recordings": _recordings(by_model[0]),
        "models": {of[0].model: _model(of) for of in by_model},
    }
    if made is not None:
        content["made"] = made.document()
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _model(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    first, *others = by_output(comparisons).items()
    content = {"rms": json_number(together(first[1])), "recordings": _recordings(comparisons)}
    if others:
        content["outputs"] = {label: {"unit": of[0].unit, "rms": json_number(together(of))} for label, of in others}
    return content


def _recordings(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    return {
        each.record.name: _output(each)
        | {"load_torque": json_number(each.load_torque)}
        | ({"outputs": {of.record.label: _output(of) for of in each.further}} if each.further else {})
        for each in comparisons
    }


def _output(each: Comparison) -> dict[str, Any]:
    return {
        **fields_as_json(each, "unit", "rms", "largest", "fit_percent"),
        "samples_used": int(each.record.okay.sum()),
        "samples": int(each.record.okay.size),
        "residual": {
            "past_input_p_value": json_number(each.past_input.p_value),
            "autocorrelation_p_value": json_number(each.itself.p_value),
        },
    }


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
    """
    _require_own_names(models)
    files = {path: read_model_for_recordings(path, trust.laws) for path in models if not is_fmu(path)}
    reads = next(iter(files.values()), None)
    signals, on_bench = (None, False) if reads is None else (reads.signals, reads.on_bench)
    prepared: Prepared | None = next((file.prepared for file in files.values() if file.prepared is not None), None)
    read = read_records(recordings, signals, on_bench, dbc, tell)
    if reads is not None:
        tell_doubts(read, recordings, reads.model, signals, dbc, tell)
    records, unusable = with_usable_channels(prepare_again(read, prepared, tell))
    for line in () if reads is not None else unusable:
        tell(line)
    by_model = [_of_model(path, files.get(path), records, recordings, mapped, trust) for path in models]
    for each in (comparison for of_model in by_model for comparison in of_model):
        for sentence in each.beyond:
            tell(f"{each.model}: {sentence}")
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
