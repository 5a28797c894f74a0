"""Validation: a physical model fitted to every other run, and held against the runs it has not seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from estimator.identification.modes.modes import Mode, two_mass_resonance
from estimator.physics.model import parameter_unit
from hil.commission.analysis.measured import TRUSTED
from hil.commission.finding import Finding, stated
from hil.commission.model_json import model_json
from hil.commission.readings import record_of, thinned
from hil.commission.step import Job, Outcome, Step
from hil.commission.steps.identification import cruises
from hil.errors import UsageError
from hil.report.numbers import shown

if TYPE_CHECKING:
    from hil.commission.analysis.physical_fit import PhysicalFit
    from hil.report.comparison import Comparison

UNSEEN = 1.2
"""Largest error on unseen runs over that on the runs of the fit: beyond, the model is made for those runs only."""

NOISE = 1.5
"""Error over the standstill noise up to which nothing of size is missing in the model."""

RESONANCE = 0.03
"""Resonance of the physical model against that of the runs, relative."""

MODEL_FILE = "nominal.toml"


def _about(job: Job) -> str:
    return (
        "fits motor inertia, load inertia, shaft stiffness, damping and friction to every other PRBS run and simulates "
        f"the others. Writes {MODEL_FILE}. Computes; commands no torque."
    )


def _do(job: Job) -> Outcome:
    from hil.commission.analysis.physical_fit import fit_two_mass  # a second, and the bus comes first
    from hil.plants import ModelPlant
    from hil.report.comparison import compare_record

    runs = cruises(job)
    records = [record_of(job.recording(run)) for run in runs]
    seen, unseen = records[::2], records[1::2]
    mode = _mode(job)
    job.progress("fitting motor, shaft and load", 0.1)
    measured = job.evidence("friction").get("inertia_kg_m2", [None])[0]
    inertia = job.rig.vehicle.inertia_kg_m2 if measured is None else float(measured)
    fit = fit_two_mass(seen, inertia, mode)
    job.progress("simulating unseen runs", 0.8)
    compared = [compare_record(ModelPlant("fitted", fit.model), record) for record in unseen]
    job.progress("validated", 1.0)
    return Outcome(_findings(job, fit, mode, compared), _evidence(fit, compared))


def _mode(job: Job) -> Mode:
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


def _findings(job: Job, fit: PhysicalFit, mode: Mode, compared: list[Comparison]) -> list[Finding]:
    unseen = float(np.sqrt(np.mean([each.rms**2 for each in compared])))
    noise = job.evidence("noise").get("speed_std_rad_s")
    physical = two_mass_resonance(**fit.model.values())
    percent = [each.fit_percent for each in compared]
    findings = [
        Finding(
            "error on unseen runs (free run, RMS)",
            f"at most {UNSEEN:g} times the {shown(fit.rms, 'rad/s')} on the runs of the fit",
            f"{shown(unseen, 'rad/s')}, {unseen / fit.rms:.2f} times",
            unseen <= UNSEEN * fit.rms,
            "The runs differ: look at road, wind and load in the report, and at the diagnosis",
        ),
        stated("fit on unseen runs", f"{min(percent):.1f} to {max(percent):.1f} %"),
    ]
    if noise:
        findings.append(
            Finding(
                "error against the standstill noise",
                f"at most {NOISE:g} times",
                f"{unseen / noise:.2f} times {shown(noise, 'rad/s')}",
                unseen <= NOISE * noise,
                "There is more than motor, shaft and load: see the diagnosis",
            )
        )
    if physical is not None:
        off = physical.frequency_hz / mode.frequency_hz - 1.0
        findings.append(
            Finding(
                "resonance of the physical model",
                f"that of the runs, {shown(mode.frequency_hz, 'Hz')}, within {100.0 * RESONANCE:g} %",
                f"{shown(physical.frequency_hz, 'Hz')}, {100.0 * off:+.2f} %",
                abs(off) <= RESONANCE,
                "Two masses and a spring do not explain everything: see the diagnosis",
            )
        )
    return [*findings, *_parameter_findings(fit)]


def _parameter_findings(fit: PhysicalFit) -> list[Finding]:
    return [
        Finding(
            name,
            f"known within ±{100.0 * TRUSTED:g} %",
            value.shown(parameter_unit(name, fit.model.motion)),
            value.ci95 <= TRUSTED * abs(value.value),
            "These runs do not determine it well: drive longer, or take it from the maker",
        )
        if name in ("J_M", "J_L", "k", "c")
        else stated(name, value.shown(parameter_unit(name, fit.model.motion)))
        for name, value in fit.parameters.items()
    ]


def _evidence(fit: PhysicalFit, compared: list[Comparison]) -> dict[str, Any]:
    worst = max(compared, key=lambda each: each.rms)
    measured = np.where(worst.record.okay, worst.record.output, np.nan)
    drawn = thinned(worst.record.time_s, worst.simulated, np.nan_to_num(measured, nan=float(np.nanmean(measured))))
    return {
        "model": model_json(fit.model),
        "parameters": {name: [value.value, value.ci95] for name, value in fit.parameters.items()},
        "rms_rad_s": fit.rms,
        "unseen": {each.record.name: {"rms_rad_s": each.rms, "fit_percent": each.fit_percent} for each in compared},
        "worst": {
            "name": worst.record.name,
            **dict(zip(("time_s", "simulated_rad_s", "measured_rad_s"), drawn, strict=True)),
        },
    }


STEP = Step("validation", "Validation", _about, _do, needs=("identification",))
