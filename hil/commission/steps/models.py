"""A model of the driveline fitted and validated on unseen runs, and the diagnosis of what it lacks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from estimator.identification.modes.modes import Mode, two_mass_resonance
from estimator.physics.model import DrivelineModel, parameter_unit
from hil.commission.responses import TRUSTED, Measured, record_of, thinned
from hil.commission.state import StepFinding, model_from_json, model_json, stated
from hil.commission.step import Outcome, Step, StepContext
from hil.commission.steps.experiments import cruises
from hil.config.model_file import write_model
from hil.errors import UsageError
from hil.provenance import Provenance, provenance
from hil.report.numbers import shown
from hil.result_folder import publish

if TYPE_CHECKING:
    from estimator.diagnosis.result import Diagnosis
    from hil.commission.physical_fit import PhysicalFit
    from hil.report.comparison import Comparison


UNSEEN = 1.2
"""Largest error on unseen runs over that on the runs of the fit: beyond, the model is made for those runs only."""

NOISE = 1.5
"""Error over the standstill noise up to which nothing of size is missing in the model."""

RESONANCE = 0.03
"""Resonance of the physical model against that of the runs, relative."""

LONGER = "These runs do not determine it well: drive longer, or take it from the maker"

MODEL_FILE = "nominal.toml"

FOLDER = "diagnosis"
AUGMENTED = "model.toml"
NOMINAL_FILE = "nominal.toml"

OTHERS = ("tip", "reversal")
"""Explained next to the slowest and the fastest PRBS run.

Nothing is held out as a whole: a gain that is wrong shows in some of these only, and a recording that can't show it
would speak against it. The diagnosis keeps stretches of each back instead.
"""

ALONE = ("m1", "m2")
"""Explained, too: each inverter by itself, from the scales step. Nothing tells a wrong gain of one as well."""


def _about_validation(job: StepContext) -> str:
    return (
        "fits motor inertia, load inertia, shaft stiffness, damping and friction to every other PRBS run and simulates "
        f"the others. Writes {MODEL_FILE}. Computes; commands no torque."
    )


def _do_validation(job: StepContext) -> Outcome:
    from hil.commission.physical_fit import fit_two_mass  # a second, and the bus comes first
    from hil.plants import ModelPlant
    from hil.report.comparison import compare_record

    runs = cruises(job)
    records = [record_of(job.recording(run)) for run in runs]
    seen, unseen = records[::2], records[1::2]
    mode = _mode(job)
    job.progress("fitting motor, shaft and load", 0.1)
    inertia = float(job.evidence("friction").get("inertia_kg_m2", [job.rig.vehicle.inertia_kg_m2])[0])
    fit = fit_two_mass(seen, inertia, mode)
    job.progress("simulating unseen runs", 0.8)
    compared = [compare_record(ModelPlant("fitted", fit.model), record) for record in unseen]
    findings, fit = validated(fit, compared, mode, job.evidence("noise").get("speed_std_rad_s"))
    job.progress("validated", 1.0)
    return Outcome(findings, _evidence_validation(fit, compared))


def _mode(job: StepContext) -> Mode:
    """Return the resonance of the runs, or of the first look."""
    found = [run["best"]["resonance"] for run in job.evidence("identification").get("runs", [])]
    known = [resonance for resonance in found if resonance is not None]
    if known:
        frequency, damping = np.median(np.array(known), axis=0)
        return Mode(float(frequency), float(damping))
    if "resonance" in job.evidence("scales"):
        return Mode(*job.evidence("scales")["resonance"])
    raise UsageError(
        f"commissioning in {job.folder}: expected a resonance from identification or scales, got none. Repeat one of "
        "them (--repeat identification), or skip this step."
    )


def validated(
    fit: PhysicalFit, compared: Sequence[Comparison], mode: Mode, noise_rad_s: float | None
) -> tuple[list[StepFinding], PhysicalFit]:
    """Judge a fit by runs that it has not seen; where the line is another its values are not determined."""
    unseen_rad_s = float(np.sqrt(np.mean([each.rms**2 for each in compared])))
    of_structure = list(_structure_findings(fit, unseen_rad_s, mode, noise_rad_s))
    if any(finding.within is False for finding in of_structure):
        fit = fit.undetermined()
    return [*_unseen_findings(fit, compared, unseen_rad_s), *of_structure, *_parameter_findings(fit)], fit


def _unseen_findings(fit: PhysicalFit, compared: Sequence[Comparison], unseen_rad_s: float) -> list[StepFinding]:
    percent = [each.fit_percent for each in compared]
    return [
        StepFinding(
            "error on unseen runs (free run, RMS)",
            f"at most {UNSEEN:g} times the {shown(fit.rms, 'rad/s')} on the runs of the fit",
            f"{shown(unseen_rad_s, 'rad/s')}, {unseen_rad_s / fit.rms:.2f} times",
            unseen_rad_s <= UNSEEN * fit.rms,
            "The runs differ: look at road, wind and load in the report, and at the diagnosis",
        ),
        stated("fit on unseen runs", f"{min(percent):.1f} to {max(percent):.1f} %"),
    ]


def _structure_findings(
    fit: PhysicalFit, unseen_rad_s: float, mode: Mode, noise_rad_s: float | None
) -> Iterator[StepFinding]:
    """Yield what shows whether the line is motor, shaft and load alone."""
    physical = two_mass_resonance(**fit.model.values())
    if noise_rad_s:
        yield StepFinding(
            "error against the standstill noise",
            f"at most {NOISE:g} times",
            f"{unseen_rad_s / noise_rad_s:.2f} times {shown(noise_rad_s, 'rad/s')}",
            unseen_rad_s <= NOISE * noise_rad_s,
            "There is more than motor, shaft and load: see the diagnosis",
        )
    if physical is not None:
        off = physical.frequency_hz / mode.frequency_hz - 1.0
        yield StepFinding(
            "resonance of the physical model",
            f"that of the runs, {shown(mode.frequency_hz, 'Hz')}, within {100.0 * RESONANCE:g} %",
            f"{shown(physical.frequency_hz, 'Hz')}, {100.0 * off:+.2f} %",
            abs(off) <= RESONANCE,
            "Two masses and a spring do not explain everything: see the diagnosis",
        )


def _parameter_findings(fit: PhysicalFit) -> list[StepFinding]:
    return [
        StepFinding(
            name,
            f"known within ±{100.0 * TRUSTED:g} %",
            _value(name, value, fit),
            value.ci95 <= TRUSTED * abs(value.value),
            LONGER if math.isfinite(value.ci95) else "See the diagnosis: what it finds missing determines this too",
        )
        if name in ("J_M", "J_L", "k", "c")
        else stated(name, _value(name, value, fit))
        for name, value in fit.parameters.items()
    ]


def _value(name: str, value: Measured, fit: PhysicalFit) -> str:
    unit = parameter_unit(name, fit.model.motion)
    if math.isfinite(value.ci95):
        return value.shown(unit)
    return f"about {shown(value.value, unit)}, not determined: the model leaves more than noise"


def _evidence_validation(fit: PhysicalFit, compared: list[Comparison]) -> dict[str, Any]:
    worst = max(compared, key=lambda each: each.rms)
    measured = np.where(worst.record.okay, worst.record.output, np.nan)
    drawn = thinned(worst.record.time_s, worst.simulated, np.nan_to_num(measured, nan=float(np.nanmean(measured))))
    return {
        "model": model_json(fit.model),
        "parameters": fit.parameters,
        "rms_rad_s": fit.rms,
        "unseen": {each.record.name: {"rms_rad_s": each.rms, "fit_percent": each.fit_percent} for each in compared},
        "worst": {
            "name": worst.record.name,
            **dict(zip(("time_s", "simulated_rad_s", "measured_rad_s"), drawn, strict=True)),
        },
    }


VALIDATION = Step("validation", "Validation", _about_validation, _do_validation, needs=("identification",))


def _about_diagnosis(job: StepContext) -> str:
    return (
        "questions the model with the slowest and the fastest PRBS run, tip, reversal and the runs of one inverter "
        f"alone, and judges on stretches kept back. Writes {AUGMENTED} and {FOLDER}/report.html. Commands no torque."
    )


def _do_diagnosis(job: StepContext) -> Outcome:
    from estimator.diagnosis.diagnose import diagnose  # a second, and the bus comes first; so do those below

    nominal, paths = nominal_of(job), explained(job)
    result = diagnose([record_of(path) for path in paths], nominal, (), job.progress)
    _publish(job, result, nominal, provenance(recordings=paths, rig=job.rig.name))
    return Outcome(_findings_diagnosis(result), _evidence_diagnosis(result))


def explained(job: StepContext) -> list[Path]:
    """Return the recordings that are diagnosed together."""
    runs = {run.name: run for run in cruises(job)}
    slow_to_fast = sorted(runs.values(), key=lambda run: run.measured["speed_measured_rad_s"][0])
    others = [run for run in job.runs_of("experiments") if run.name in OTHERS]
    others += [run for run in job.runs_of("scales") if run.name in ALONE]
    return [job.recording(run) for run in (slow_to_fast[0], slow_to_fast[-1], *others)]


def nominal_of(job: StepContext) -> DrivelineModel:
    """Return the user's own model, else the one of the validation; `UsageError` where there is neither."""
    if job.nominal is not None:
        return job.nominal
    document = job.evidence("validation").get("model")
    if document is None:
        raise UsageError(
            f"commissioning in {job.folder}: expected a model from the validation, or one given by --model, got "
            "neither. Repeat the validation (--repeat validation), or skip this step."
        )
    return model_from_json(document)


def _publish(job: StepContext, result: Diagnosis, nominal: DrivelineModel, made: Provenance) -> None:
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
            AUGMENTED: lambda path: write_model(path, result.augmented),
        },
    )


def _findings_diagnosis(result: Diagnosis) -> list[StepFinding]:
    from estimator.diagnosis.result import Verdict
    from estimator.physics.catalogue import title_of
    from hil.report.wording import headline

    fit = result.fit
    advice = {
        Verdict.NO_MISMATCH: "",
        Verdict.EXPLAINED: f"{AUGMENTED} has it; see the diagnosis for its evidence, and whether it is to be fixed",
        Verdict.PARTLY_EXPLAINED: f"{AUGMENTED} has what is established; see the diagnosis for what it leaves",
        Verdict.UNEXPLAINED: "See where it is in the diagnosis, and what to look at there",
    }[result.verdict]
    findings = [
        StepFinding(
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
    findings += [stated(f"found: {title_of(effect.name)}", effect.statement) for effect in result.effects]
    findings += [
        StepFinding(
            f"can't tell: {title_of(each.name)}", "–", each.reason, None, f"{each.cure[0].upper()}{each.cure[1:]}."
        )
        for each in result.untestable
    ]
    return findings


def _evidence_diagnosis(result: Diagnosis) -> dict[str, object]:
    from hil.report.wording import headline

    return {
        "verdict": result.verdict.value,
        "headline": headline(result),
        "statement": result.statement,
        "effects": [effect.name for effect in result.effects],
        "alike": sorted({name for effect in result.effects for name in effect.indistinguishable_from}),
        "report": f"{FOLDER}/report.html",
        "model_file": AUGMENTED,
        "seconds": result.timing_s.get("total"),
        "parameters": {
            name: {"nominal": each.nominal, "value": each.value, "ci95": list(each.ci95), "unit": each.unit}
            for name, each in result.parameters.items()
        },
    }


DIAGNOSIS = Step("diagnosis", "Diagnosis", _about_diagnosis, _do_diagnosis, needs=("validation",))
