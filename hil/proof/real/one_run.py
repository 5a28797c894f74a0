"""One run of a case from question to judgement; kept in its folder, so that it need not be made again."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from estimator.diagnosis.inference.figures import blocks
from estimator.signals.record import BoolArray
from hil.parse_json import read_json
from hil.proof.command import CommandFailed
from hil.proof.real.ask import AFTER, BEFORE, Answer, ask
from hil.proof.real.black_box.compare import Split, compare
from hil.proof.real.case_file import CASE, MODEL, TRUTH, CaseFile, Judged, Measure, RunEntry
from hil.proof.real.grade import correlation, true_grade
from hil.proof.real.held_out import inner_blocks
from hil.proof.real.judge import goal_agreement, value_agreement
from hil.proof.real.measure import error_of, load_course
from hil.proof.real.prepare import full_table
from hil.proof.real.result import Errors, RunResult, run_from, run_json
from hil.proof.real.truth_file import TruthFile, read_truth

KEPT = "run.json"

OWN_BLOCKS = "blocks kept out"
"""Stands for a recording where the diagnosis judged on blocks of the fitted one."""


def make_run(folder: Path, case: CaseFile, run: RunEntry, data: Path, out: Path, limit_s: float) -> RunResult:
    """Return one run's result, made anew unless it is kept and nothing of it has changed.

    Parameters
    ----------
    folder
        The case's.
    data
        Where the recordings are.
    out
        The run's folder; gets ``out/diagnosis.json``, ``out/report.html``, the models and ``run.json``.
    limit_s
        Time for one command [s].

    Raises
    ------
    RealFileError
        If a recording is not there or not the one that was meant, or the truth file is wrong.
    """
    asked, key = (_key(folder, names) for names in ((CASE, MODEL), (CASE, MODEL, TRUTH)))
    kept = out / KEPT
    if kept.exists():
        content = read_json(kept)
        if content["key"] == key and content["run"]["fault"] is None:
            return run_from(content["run"])
    began = time.perf_counter()
    try:
        answer = ask(folder, case, run, data, out / "out", asked, limit_s)
    except CommandFailed as failure:
        result = RunResult(run.name, fault=str(failure), duration_s=time.perf_counter() - began)
    else:
        result = _judged(folder, case, run, data, answer, time.perf_counter() - began)
    out.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps({"key": key, "run": run_json(result)}, indent=1), encoding="utf-8")
    return result


def _key(folder: Path, names: Sequence[str]) -> str:
    """Return what changes with the case's files; the recordings are in it by their checksums."""
    return hashlib.sha256(b"".join((folder / name).read_bytes() for name in names)).hexdigest()


def _judged(folder: Path, case: CaseFile, run: RunEntry, data: Path, answer: Answer, duration_s: float) -> RunResult:
    truth = read_truth(folder)
    fit, held_out = _errors(case, run, answer)
    unit = answer.diagnosis["fit"]["unit"] if case.measure is Measure.RMS else ""
    errors = {"fit": fit.after, "held_out": held_out.after}
    agreements = [value_agreement(known, answer.diagnosis) for known in truth.values]
    agreements += [goal_agreement(goal, errors[goal.on], unit) for goal in truth.goals]
    return RunResult(
        name=run.name,
        verdict=answer.diagnosis["verdict"],
        named=tuple(effect["name"] for effect in answer.diagnosis["effects"]),
        statement=answer.diagnosis["statement"],
        unit=unit,
        fit=fit,
        held_out=held_out,
        grade_correlation=_grade(case, run, data, answer, truth),
        agreements=tuple(agreements),
        black_boxes=compare(
            _split(case, run, answer), case.measure, answer.models[AFTER].model, case.black_box.sample_time_s
        ),
        diagnosis="out/diagnosis.json",
        report="out/report.html",
        duration_s=duration_s,
    )


def _errors(case: CaseFile, run: RunEntry, answer: Answer) -> tuple[Errors, Errors]:
    """Return the errors on the fitted and on the held-out recordings."""

    def of(names: list[str], judged: Mapping[str, BoolArray]) -> Errors:
        stages = [
            {
                name: error_of(
                    case.measure,
                    answer.records[name],
                    answer.simulated[stage][name],
                    judged[name],
                    answer.models[AFTER].model,
                )
                for name in names
            }
            for stage in (BEFORE, AFTER)
        ]
        return Errors(*stages)

    fit = of(run.fit, {name: np.asarray(answer.records[name].okay) for name in run.fit})
    if run.held_out:
        return fit, of(run.held_out, _counted(case, run, answer))
    figures = answer.diagnosis["fit"]
    own = [{OWN_BLOCKS: float(figures[key])} for key in ("holdout_retuned", "holdout_augmented")]
    return fit, Errors(*own)


def _counted(case: CaseFile, run: RunEntry, answer: Answer) -> dict[str, BoolArray]:
    """Return which samples of the held-out recordings count."""
    records = {name: answer.records[name] for name in run.held_out}
    if case.judged is Judged.EVERYWHERE:
        return {name: np.asarray(record.okay) for name, record in records.items()}
    return {name: inner_blocks(record) for name, record in records.items()}


def _split(case: CaseFile, run: RunEntry, answer: Answer) -> Split:
    """Return the same split for black boxes."""
    okay = {name: np.asarray(record.okay) for name, record in answer.records.items()}
    if not run.held_out:
        out = {name: blocks(answer.records[name]) for name in run.fit}
        rest = {name: okay[name] & ~out[name] for name in run.fit}
        return Split(answer.records, rest, rest, {name: okay[name] & out[name] for name in run.fit})
    judged = _counted(case, run, answer)
    hidden = case.judged is Judged.BLOCKS
    seen = {name: okay[name] & ~judged[name] if hidden else okay[name] for name in run.held_out}
    return Split(answer.records, {name: okay[name] for name in run.fit}, seen, judged)


def _grade(case: CaseFile, run: RunEntry, data: Path, answer: Answer, truth: TruthFile) -> float | None:
    """Return how the course that was found correlates with the withheld one; None where none was found."""
    known = truth.grade
    if known is None or known.effect not in {effect["name"] for effect in answer.diagnosis["effects"]}:
        return None
    found = []
    for name in run.fit:
        record = answer.records[name]
        table = full_table(case, name, data).numeric([known.acceleration.column, known.speed.column])
        acceleration = table[known.acceleration.column] * known.acceleration.scale
        grade = true_grade(acceleration, table[known.speed.column] * known.speed.scale, record.sample_time_s)
        load = load_course(record, answer.simulated[AFTER][name], answer.models[AFTER].model)
        found.append(correlation(load, grade, record.okay, known.low_pass_hz, record.sample_time_s))
    values = [value for value in found if value is not None]
    return float(np.median(values)) if values else None
