"""The public command, asked about a real recording in a place that holds nothing else.

`hil diagnose` gets the fitted recordings and the nominal model. Held-out recordings come into the place when it has
answered; `hil simulate` runs over them with the model before and the model after. Nothing here reads the truth.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from estimator.diagnosis.assemble import augmented_model
from estimator.diagnosis.chain import mechanical
from estimator.diagnosis.preconditions import prepare
from estimator.physics.fit import fit, make_problem
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import FloatArray, Record
from hil.config.model_file import ModelFile, read_model, read_model_for_recordings, write_model
from hil.proof.command import run_hil
from hil.proof.own_folder import replace_own
from hil.proof.real.case_file import MODEL, CaseFile, Judged, RunEntry
from hil.proof.real.held_out import inner_blocks
from hil.proof.real.prepare import write_shown
from hil.recording import read_record, read_records

BEFORE, AFTER = "before", "after"

KEY = "question.txt"
"""Says to which question an answer belongs."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What the command made of one run of a case.

    Attributes
    ----------
    diagnosis
        Content of ``diagnosis.json``.
    models
        The nominal model, re-tuned (``before``), and the one that the command wrote (``after``).
    records
        Every recording of the run by name, nothing that is shown hidden.
    simulated
        ``before`` and ``after`` to recording to output, shape (N,).
    """

    diagnosis: Mapping[str, Any]
    models: Mapping[str, ModelFile]
    records: Mapping[str, Record]
    simulated: Mapping[str, Mapping[str, FloatArray]] = field(default_factory=dict)


def ask(folder: Path, case: CaseFile, run: RunEntry, data: Path, out: Path, key: str, limit_s: float) -> Answer:
    """Run the public commands on one run of a case.

    Parameters
    ----------
    folder
        The case's; of it only the nominal model is read.
    data
        Where the recordings are.
    out
        Gets what ``hil diagnose`` wrote; an older one is replaced, unless it answers the same question.
    key
        Tells questions apart.
    limit_s
        Time for one command [s].

    Raises
    ------
    CommandFailed
        If a command does not do its job.
    RealFileError
        If a recording is not there or not the one that was meant.
    """
    with tempfile.TemporaryDirectory(prefix="hil-recording-") as neutral:
        place = Path(neutral) / "case"
        place.mkdir()
        shutil.copyfile(folder / MODEL, place / "model.toml")
        shown = [write_shown(case, name, data, place).name for name in run.fit]
        answered = Path(neutral) / "out"
        if (out / KEY).exists() and (out / KEY).read_text() == key:
            shutil.copytree(out, answered)
        else:
            run_hil(["diagnose", *shown, "--model", "model.toml", "--out", "../out"], place, limit_s)
            _write_retuned(place, [place / name for name in shown], answered)
            _keep(answered, out, key)
        diagnosis = json.loads((answered / "diagnosis.json").read_text(encoding="utf-8"))
        simulated, records = _simulate(case, run, data, Path(neutral), limit_s)
        models = {stage: read_model(answered / f"{_FILES[stage]}.toml") for stage in _FILES}
    return Answer(diagnosis, models, records, simulated)


_FILES = {BEFORE: "retuned", AFTER: "augmented"}


def _keep(answered: Path, out: Path, key: str) -> None:
    """Keep what the command wrote; the key comes last, so that what has one is whole."""
    replace_own(out, answered)
    (out / KEY).write_text(key)


def _write_retuned(place: Path, shown: list[Path], out: Path) -> None:
    """Write the nominal model as re-tuned; where nothing was named it is what the command wrote."""
    if not json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))["effects"]:
        shutil.copyfile(out / "augmented.toml", out / "retuned.toml")
        return
    file = read_model_for_recordings(place / "model.toml")
    with threadpool_limits(1, user_api="blas"):
        ready = prepare(read_records(shown, file.signals, file.on_bench), file.model)
        line = mechanical(file.model)
        result = fit(make_problem(line, ready.records, nominal_unknowns(line)))
    write_model(out / "retuned.toml", augmented_model(result, file.model, ()), file.signals, file.laws)


def _simulate(
    case: CaseFile, run: RunEntry, data: Path, neutral: Path, limit_s: float
) -> tuple[dict[str, dict[str, FloatArray]], dict[str, Record]]:
    unseen = neutral / "unseen"
    unseen.mkdir()
    file = read_model_for_recordings(neutral / "case" / "model.toml")
    records, simulated = {}, {stage: dict[str, FloatArray]() for stage in _FILES}
    for name in (*run.fit, *run.held_out):
        path = write_shown(case, name, data, unseen)
        record = records[name] = read_record(path, file.signals, file.on_bench)
        if name in run.held_out and case.judged is Judged.BLOCKS:
            write_shown(case, name, data, unseen, {column: inner_blocks(record) for column in _output_columns(file)})
        for stage, model in _FILES.items():
            arguments = ["simulate", "--model", f"../out/{model}.toml", "--input", path.name, "--out", f"{stage}.csv"]
            run_hil(arguments, unseen, limit_s)
            simulated[stage][name] = np.loadtxt(unseen / f"{stage}.csv", delimiter=",", skiprows=1)[:, 1]
    return simulated, records


def _output_columns(file: ModelFile) -> Iterable[str]:
    return () if file.signals is None else (file.signals.output()[1].column,)
