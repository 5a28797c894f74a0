"""Experiments that decide what the diagnosis leaves open: the loop of ``hil solve``, from what was recorded so far."""

from __future__ import annotations

from typing import Any

from drivers.foreign_file import read_regular
from hil.commission.state import StepFinding, stated
from hil.commission.step import Outcome, Step, StepContext
from hil.commission.steps.models import AUGMENTED, NOMINAL_FILE, explained, nominal_of
from hil.config.model_file import ModelFile
from hil.design.solve_state import SCHEMA, STATE, End, SolveState, fresh_state
from hil.result_folder import publish

NAME = "solve"
FOLDER = "solve"

MOST_VEHICLE_S = 600.0
"""Time that the vehicle may be needed for in all [s]: as ``hil solve`` without ``--vehicle-s``."""


def _about(job: StepContext) -> str:
    return (
        "designs the experiment that would decide what the diagnosis leaves open, shows it, asks, drives it and "
        f"diagnoses again, until it is decided: {MOST_VEHICLE_S / 60.0:g} min of driving at most, none where the "
        f"diagnosis has decided. Writes {AUGMENTED} and {FOLDER}/report.html."
    )


def _do(job: StepContext) -> Outcome:
    record = job.state.steps[NAME]
    if because := _needless(job):
        state = SolveState(SCHEMA, record.rig_digest, "", because=because)
        return Outcome((), STATE.dump_python(state, mode="json"), needless=because)
    from hil.design.solve import Solving  # a second, and the bus comes first

    nominal = job.folder / NOMINAL_FILE
    state = fresh_state(job.source, nominal)
    if record.evidence:  # of an attempt that was interrupted
        known, whole = STATE.validate_python(record.evidence), {run.recording for run in record.runs}
        state.driven, state.odds = [each for each in known.driven if each.recording in whole], known.odds
        state.ended_early = known.ended_early

    def keep(document: dict[str, Any]) -> None:
        record.evidence = document
        job.state.save()

    Solving(
        job.folder / FOLDER,
        job.source,
        ModelFile(nominal_of(job)),
        nominal,
        job.runner,
        job.may_command,
        state,
        explained(job),
        "normal",
        MOST_VEHICLE_S,
        job.rolling_rad_s(),
        keep,
        lambda line: job.say(f"  {line}"),
        job.progress,
        lambda run: job.note(NAME, run),
        tuple(job.rig.experiments),
    ).run()
    augmented = read_regular(job.folder / FOLDER / "augmented.toml")
    publish(job.folder, {AUGMENTED: lambda path: path.write_bytes(augmented)})
    return Outcome(_findings(state), record.evidence)


def _needless(job: StepContext) -> str:
    """Say why no experiment is needed; "" where the diagnosis abstains or names look-alikes."""
    found = job.evidence("diagnosis")
    if not found:
        return "there is no diagnosis that leaves anything open"
    if found["verdict"] in ("explained", "no_mismatch") and not found.get("alike"):
        return f"the diagnosis has decided. {found['headline']}"
    return ""


def _findings(state: SolveState) -> list[StepFinding]:
    from hil.design.report import in_words  # half a second, and the bus comes first

    odds = [", ".join(f"{in_words(name)} {p:.3f}" for name, p in each.probabilities.items()) for each in state.odds]
    findings = [
        stated(f"driven: {run.name}", f"odds before: {before}. After: {after}")
        for run, before, after in zip(state.driven, odds, odds[1:], strict=False)
    ]
    advice = state.because if state.end is End.NOTHING_DECIDES else f"{state.because}. Again by --repeat {NAME}"
    ended = "" if state.end in (None, End.DECIDED) else f", ended because {state.end.value}"
    return [
        *findings,
        StepFinding(
            f"verdict{ended}", "decided", f"{state.verdict}: {odds[-1]}", state.end is End.DECIDED or None, advice
        ),
    ]


SOLVE = Step(NAME, "Next experiments", _about, _do, needs=("diagnosis",))
