"""Diagnosis: what the model lacks, where, and which physics it is; and the rig's model file from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from estimator.physics.model import DrivelineModel
from hil.commission.finding import Finding, stated
from hil.commission.model_json import model_from_json
from hil.commission.readings import record_of
from hil.commission.step import Job, Outcome, Step
from hil.commission.steps.identification import cruises
from hil.config.model_file import write_model
from hil.errors import UsageError
from hil.provenance import Provenance, provenance
from hil.report.numbers import shown
from hil.report.outputs import publish

if TYPE_CHECKING:
    from estimator.diagnosis.result import Diagnosis

FOLDER = "diagnosis"
MODEL_FILE = "model.toml"
NOMINAL_FILE = "nominal.toml"

OTHERS = ("tip", "reversal")
"""Explained next to the slowest and the fastest PRBS run.

Nothing is held out as a whole: a gain that is wrong shows in some of these only, and a recording that can't show it
would speak against it. The diagnosis keeps stretches of each back instead.
"""

ALONE = ("m1", "m2")
"""Explained, too: each inverter by itself, from the scales step. Nothing tells a wrong gain of one as well."""


def _about(job: Job) -> str:
    return (
        "questions the model with the slowest and the fastest PRBS run, tip, reversal and the runs of one inverter "
        f"alone, and judges on stretches kept back. Writes {MODEL_FILE} and {FOLDER}/report.html. Commands no torque."
    )


def _do(job: Job) -> Outcome:
    from estimator.diagnosis.diagnose import diagnose  # a second, and the bus comes first; so do those below

    nominal = _nominal(job)
    runs = {run.name: run for run in cruises(job)}
    slow_to_fast = sorted(runs.values(), key=lambda run: run.measured.get("speed_measured_rad_s", [0.0])[0])
    others = [run for run in job.runs_of("experiments") if run.name in OTHERS]
    others += [run for run in job.runs_of("scales") if run.name in ALONE]
    chosen = [slow_to_fast[0], slow_to_fast[-1], *others]
    records = [record_of(job.recording(run)) for run in chosen]
    result = diagnose(records, nominal, (), job.progress)
    made = provenance(recordings=[job.recording(run) for run in chosen])
    _publish(job, result, nominal, made)
    return Outcome(_findings(result), _evidence(result))


def _nominal(job: Job) -> DrivelineModel:
    if job.nominal is not None:
        return job.nominal
    document = job.evidence("validation").get("model")
    if document is None:
        raise UsageError(
            f"commissioning in {job.folder}: expected a model from the validation, or one given by --model, got "
            "neither. Repeat the validation (--repeat validation), or skip this step."
        )
    return model_from_json(document)


def _publish(job: Job, result: Diagnosis, nominal: DrivelineModel, made: Provenance) -> None:
    from hil.report.diagnosis_html import diagnosis_page
    from hil.report.diagnosis_json import diagnosis_text

    publish(
        job.folder / FOLDER,
        {
            "diagnosis.json": lambda path: path.write_text(diagnosis_text(result, made), encoding="utf-8"),
            "report.html": lambda path: path.write_text(diagnosis_page(result, made), encoding="utf-8"),
        },
    )
    publish(
        job.folder,
        {
            NOMINAL_FILE: lambda path: write_model(path, nominal),
            MODEL_FILE: lambda path: write_model(path, result.augmented),
        },
    )


def _findings(result: Diagnosis) -> list[Finding]:
    from estimator.diagnosis.result import Verdict
    from hil.report.wording import headline

    fit = result.fit
    advice = {
        Verdict.NO_MISMATCH: "",
        Verdict.EXPLAINED: f"{MODEL_FILE} has it; see the diagnosis for its evidence, and whether it is to be fixed",
        Verdict.PARTLY_EXPLAINED: f"{MODEL_FILE} has what is established; see the diagnosis for what it leaves",
        Verdict.UNEXPLAINED: "See where it is in the diagnosis, and what to look at there",
    }[result.verdict]
    findings = [
        Finding(
            "verdict",
            "the model, re-tuned, explains the recordings",
            headline(result),
            result.verdict is Verdict.NO_MISMATCH,
            advice,
        ),
        stated(
            "free-run error (RMS)",
            f"nominal {shown(fit.nominal, fit.unit)}, re-tuned {shown(fit.retuned, fit.unit)}, augmented "
            f"{shown(fit.augmented, fit.unit)}, noise floor {shown(fit.noise_floor, fit.unit)}",
        ),
    ]
    findings += [stated(f"found: {effect.name}", effect.statement) for effect in result.effects]
    findings += [
        Finding(f"can't tell: {each.name}", "–", each.reason, None, f"{each.cure[0].upper()}{each.cure[1:]}.")
        for each in result.untestable
    ]
    return findings


def _evidence(result: Diagnosis) -> dict[str, object]:
    from hil.report.wording import headline

    return {
        "verdict": result.verdict.value,
        "headline": headline(result),
        "statement": result.statement,
        "effects": [effect.name for effect in result.effects],
        "report": f"{FOLDER}/report.html",
        "model_file": MODEL_FILE,
        "seconds": result.timing_s.get("total"),
        "parameters": {
            name: {"nominal": each.nominal, "value": each.value, "ci95": list(each.ci95), "unit": each.unit}
            for name, each in result.parameters.items()
        },
    }


STEP = Step("diagnosis", "Diagnosis", _about, _do, needs=("validation",))
