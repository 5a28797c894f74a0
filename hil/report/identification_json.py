"""``identification.json``: what was identified, and what questioning it adds."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from estimator.identification.identify import Compared, Identification, Study
from estimator.identification.joint import Together
from estimator.identification.linear_model import ComplexArray, LinearModel
from estimator.identification.modes.modes import Mode, Uncertain
from estimator.identification.modes.physical import PhysicalEstimate
from estimator.identification.offline.fits import FreeRun
from estimator.identification.offline.validation import OrderChoice
from estimator.identification.settings import Settings
from estimator.identification.spectral import Distortion, SpectralEstimate
from hil.provenance import Provenance
from hil.report.identification_wording import best_statement, joint_statement, verdict
from hil.report.numbers import as_json, fields_as_json, json_number

SCHEMA: Final = "hil.identification/1"
FILE_NAME: Final = "identification.json"


def studied(each: Study) -> dict[str, Any]:
    """Return intervals, third order, validation, feedback, cancellations, physical parameters; JSON types only."""
    return {
        "best": _best(each),
        "resonance_interval": None
        if each.resonance is None
        else {
            "frequency_hz": _uncertain(each.resonance.frequency_hz),
            "damping": _uncertain(each.resonance.damping),
        },
        "third_order": {
            "theta": each.third_order.model.theta.tolist(),
            "nk": each.third_order.model.nk,
            "poles": _pairs(each.third_order.model.poles),
            "zeros": _pairs(each.third_order.model.zeros),
            "largest_change": json_number(each.third_order.largest_error),
        },
        "validation": {
            "statement": each.validation.statement,
            "own": _free_run(each.validation.own),
            "unseen": [_free_run(run) for run in each.validation.unseen],
            **fields_as_json(each.validation, "independence", "autocorrelation"),
        },
        "feedback": as_json(each.feedback),
        "cancellations": [
            {
                "pole": [one.pole.real, one.pole.imag],
                "zero": [one.zero.real, one.zero.imag],
                "p_value": json_number(one.p_value),
            }
            for one in each.roots.cancellations
        ],
        "physical": _physical(each.physical, each.not_physical),
    }


def _joint(together: Together | None) -> dict[str, Any] | None:
    """Return the joint estimate; frequency and damping are null where the data carry no pole pair."""
    if together is None:
        return None
    joint, _ = together
    content: dict[str, Any] = {"statement": joint_statement(together)}
    if joint is None:
        return content
    mode = joint.mode
    return content | {
        "recordings": list(joint.names),
        "disagreeing": as_json(joint.disagreeing),
        "doubtful": list(joint.doubtful),
        "frequency_hz": None if mode is None else _uncertain(mode.frequency_hz),
        "damping": None if mode is None else _uncertain(mode.damping),
        "sample_time_s": joint.model.sample_time_s,
        "A": joint.model.A.tolist(),
        "B": joint.model.B.tolist(),
        "covariance": joint.covariance.tolist(),
        "physical": _physical(joint.physical, joint.not_physical),
    }


def _best(each: Study) -> dict[str, Any]:
    """Return the headline; frequency and damping are null where the data carry no pole pair."""
    best, mode = each.best, each.best.mode
    linearity = best.linearity
    return {
        "estimator": best.fit.method.value,
        "frequency_hz": None if mode is None else mode.frequency_hz.value,
        "damping": None if mode is None else mode.damping.value,
        "frequency_ci95_hz": None if mode is None else as_json(mode.frequency_hz.ci95),
        "damping_ci95": None if mode is None else as_json(mode.damping.ci95),
        "statement": best_statement(each),
        "verdict": best.verdict.value,
        "advice": verdict(each),
        "band_hz": list(best.band_hz),
        "order": best.fit.model.orders.na,
        "sample_time_s": best.fit.model.sample_time_s,
        "A": best.fit.model.A.tolist(),
        "B": best.fit.model.B.tolist(),
        "covariance": best.fit.covariance.tolist(),
        "independence": as_json(best.validation.independence),
        "linearity": {
            "p_value": json_number(linearity.p_value),
            "linear": linearity.is_linear,
            "depends_on": None if linearity.is_linear else linearity.depends_on,
        },
        "by_shaft_torque": [
            {
                "low_nm": one.low,
                "high_nm": one.high,
                "frequency_hz": None if one.mode is None else one.mode.frequency_hz,
                "damping": None if one.mode is None else one.mode.damping,
            }
            for one in best.regions
        ],
    }


def _uncertain(estimate: Uncertain) -> dict[str, Any]:
    """Return a value with its standard deviation and interval; null where not finite."""
    return fields_as_json(estimate, "value", "std", "ci95")


def _free_run(run: FreeRun) -> dict[str, Any]:
    return fields_as_json(run, "name", "rms", "fit_percent", "one_step_fit_percent")


def _physical(physical: PhysicalEstimate | None, reason: str) -> dict[str, Any]:
    if physical is None:
        return {"parameters": {}, "sums": {}, "reason": reason}
    groups = {"parameters": physical.parameters, "sums": physical.sums}
    content: dict[str, Any] = {
        group: {
            name: _uncertain(one.estimate)
            | {"unit": one.unit, "determined": one.is_determined, "statement": one.statement}
            for name, one in members.items()
        }
        for group, members in groups.items()
    }
    return content | {"reason": ""}


def identification_text(
    results: Sequence[Identification],
    settings: Settings,
    nominal: Mode | None,
    studies: Sequence[Study] = (),
    choice: OrderChoice | None = None,
    compared: Sequence[Compared] = (),
    made: Provenance | None = None,
    together: Together | None = None,
) -> str:
    """Return the text of identification.json; ``studies`` is empty or has one for each of the results."""
    extras: list[dict[str, Any]] = [studied(each) for each in studies] or [{} for _ in results]
    document = {
        "schema": SCHEMA,
        "settings": {
            **as_json(settings.orders),
            "sample_time_s": settings.sample_time_s,
            "offline_sample_time_s": settings.offline_sample_time_s,
            "high_pass_hz": settings.high_pass_hz,
            "samples": settings.samples,
            "filter_part": settings.filter_part.value,
            "band_hz": list(settings.band_hz),
        },
        "nominal_resonance": _mode(nominal),
        "order_choice": None if choice is None else _choice(choice),
        "recordings": [_recording(result) | extra for result, extra in zip(results, extras, strict=True)],
        "joint": _joint(together),
        "compared": [_compared(each) for each in compared],
    }
    if made is not None:
        document["made"] = made.document()
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _recording(found: Identification) -> dict[str, Any]:
    estimate, batch = found.estimate, found.batch
    online = _model(found.online, found.online_resonance) | {
        "status": estimate.status.value,
        "reason": estimate.reason.message,
        "samples_used": int(found.trajectory.used.sum()),
    }
    offline = _model(batch.model, found.batch_resonance) | {
        "covariance": batch.covariance.tolist(),
        "rms": batch.rms,
        "fit_percent": batch.fit_percent,
        "one_step_fit_percent": json_number(batch.one_step_fit_percent),
        "samples_used": batch.n_samples,
    }
    return {
        "name": found.name,
        "output": found.data.kind.value,
        "online": online,
        "batch": offline,
        "filter_L": found.L.tolist(),
        "spectral": None if found.spectral is None else _spectral(found.spectral),
        "no_spectral": found.no_spectral,
    }


def _model(model: LinearModel, resonance: Mode | None) -> dict[str, Any]:
    return {
        "theta": model.theta.tolist(),
        "A": model.A.tolist(),
        "B": model.B.tolist(),
        "sample_time_s": model.sample_time_s,
        "poles": _pairs(model.poles),
        "zeros": _pairs(model.zeros),
        "resonance": _mode(resonance),
    }


def _pairs(roots: ComplexArray) -> list[list[float]]:
    return [[float(root.real), float(root.imag)] for root in roots]


def _mode(mode: Mode | None) -> dict[str, float] | None:
    return None if mode is None else {"frequency_hz": mode.frequency_hz, "damping": mode.damping}


def _spectral(estimate: SpectralEstimate) -> dict[str, Any]:
    return {
        "frequency_hz": as_json(estimate.frequency_hz),
        "magnitude": as_json(np.abs(estimate.response)),
        "phase_rad": as_json(np.angle(estimate.response)),
        **fields_as_json(estimate, "magnitude_std", "coherence"),
        "n_averages": estimate.n_averages,
        "used_samples": estimate.used_samples,
        "bridged_samples": estimate.bridged_samples,
        "distortion": None if estimate.distortion is None else _distortion(estimate.distortion),
    }


def _distortion(distortion: Distortion) -> dict[str, Any]:
    levels = {"even": distortion.level(even=True), "odd": distortion.level(even=False)}
    by_kind = {name: as_json({"rms": level, "p_value": p_value}) for name, (level, p_value) in levels.items()}
    return by_kind | {"noise": json_number(distortion.noise_rms)}


def _choice(choice: OrderChoice) -> dict[str, Any]:
    return {
        "statement": choice.statement,
        "candidates": [
            as_json(each.orders) | fields_as_json(each, "criterion", "rms", "unseen_fit_percent")
            for each in choice.candidates
        ],
    }


def _compared(each: Compared) -> dict[str, Any]:
    return {
        **fields_as_json(each, "recording", "estimator"),
        "resonance": _mode(each.resonance),
        **fields_as_json(each, "fit_percent", "status", "reason"),
    }
