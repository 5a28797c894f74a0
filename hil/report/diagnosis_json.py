"""``diagnosis.json`` (CONTRACT, schema ``hil.diagnosis/1``): a Diagnosis for scripts.

Keys beyond the contract: ``warnings``, ``load_torque`` per recording, ``unnamed`` (the law without a name where nothing
explains the mismatch), ``profiles`` in an effect that was found as a course over time, and ``discrepancy``: the best
law without a name at each element, the likelihood of each place, and the tests over frequency; ``strays``: nominal
values that alone would explain the mismatch, beyond what they are trusted to.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Estimated,
    Evidence,
    Fit,
    FoundEffect,
    Interval,
    LawPicture,
    Mismatch,
    OutputFit,
    Profile,
    RejectedEffect,
    Remainder,
    Retuned,
    Slight,
    UnnamedLaw,
)
from hil.provenance import Provenance
from hil.report.numbers import json_number

SCHEMA = "hil.diagnosis/1"

Json = dict[str, Any]


def diagnosis_text(diagnosis: Diagnosis, made: Provenance | None = None) -> str:
    """Return the text of the file."""
    content = diagnosis_json(diagnosis) | ({} if made is None else {"made": made.document()})
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def diagnosis_json(diagnosis: Diagnosis) -> Json:
    """Return the content of the file; a number that is not finite is None."""
    return {
        "schema": SCHEMA,
        "verdict": diagnosis.verdict.value,
        "statement": diagnosis.statement,
        "mismatch": _mismatch(diagnosis.mismatch),
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "rejected": [_rejected(rival) for rival in diagnosis.rejected],
        "untestable": [
            {"name": entry.name, "reason": entry.reason, "suggested_test": entry.suggested_test}
            | ({"needs": entry.needs} if entry.needs else {})
            for entry in diagnosis.untestable
        ],
        "unnamed": None if diagnosis.unnamed is None else _unnamed(diagnosis.unnamed),
        "fit": _fit(diagnosis.fit),
        "parameters": {name: _retuned(value) for name, value in diagnosis.parameters.items()},
        "load_torque": {name: _estimated(value) for name, value in diagnosis.load_torque.items()},
        "timing_s": {name: json_number(value) for name, value in diagnosis.timing_s.items()},
        "warnings": list(diagnosis.warnings),
        "discrepancy": None if diagnosis.discrepancy is None else _discrepancy(diagnosis.discrepancy),
        "strays": [
            {"parameter": value.name, "ratio": json_number(value.ratio), "tolerance": json_number(value.tolerance)}
            for value in diagnosis.off_nominal
        ],
        "remainder": None if diagnosis.remainder is None else _remainder(diagnosis.remainder),
        "traces": [_slight(each) for each in diagnosis.slight],
        "effort": {
            "level": diagnosis.effort.level,
            "simulations": diagnosis.effort.simulations,
            "finished": diagnosis.effort.finished,
            "untried": list(diagnosis.effort.untried),
        },
    }


def _remainder(remainder: Remainder) -> Json:
    return {
        "share": json_number(remainder.share),
        "times_noise": json_number(remainder.times_noise),
        "element": None if remainder.element is None else remainder.element.value,
        "band_hz": None if remainder.band_hz is None else _numbers(remainder.band_hz),
        "law": remainder.law,
    }


def _slight(trace: Slight) -> Json:
    parameters = {name: json_number(value) for name, value in trace.parameters.items()}
    return {"name": trace.name, "share": json_number(trace.share), "parameters": parameters}


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [json_number(float(value)) for value in values]


def _times(time_s: Mapping[str, Iterable[Interval]]) -> Json:
    return {name: [_numbers(interval) for interval in intervals] for name, intervals in time_s.items()}


def _mismatch(mismatch: Mismatch) -> Json:
    region = mismatch.region
    return {
        "detected": mismatch.detected,
        "element": None if mismatch.element is None else mismatch.element.value,
        "time_s": _times(mismatch.time_s),
        "band_hz": None if mismatch.band_hz is None else _numbers(mismatch.band_hz),
        "region": None
        if region is None
        else {"signal": region.signal, "low": json_number(region.low), "high": json_number(region.high)},
        "p_value": json_number(mismatch.p_value),
    }


def _unnamed(law: UnnamedLaw) -> Json:
    return {
        "element": law.element.value,
        "terms": [{"law": name, "coefficient": json_number(value)} for name, value in law.terms],
        "rms_before": json_number(law.rms_before),
        "rms_after": json_number(law.rms_after),
    }


def _discrepancy(seen: Discrepancy) -> Json:
    """Return what a script may want of the report's pictures: tests and laws, not courses over time."""
    return {
        "element": None if seen.element is None else seen.element.value,
        "laws": [
            {
                "element": law.element.value,
                "terms": [{"law": name, "coefficient": json_number(value)} for name, value in law.terms],
                "rms_after": json_number(law.rms),
                "delta_bic": json_number(law.delta_bic),
                "p_value": json_number(law.p_value),
            }
            for law in seen.laws
        ],
        "places": [
            {
                "place": each.place,
                "unit": each.unit,
                "log_likelihood": json_number(each.log_likelihood),
                "plausible": each.plausible,
            }
            for each in seen.equivalents
        ],
        "bands": [
            {
                "band_hz": _numbers((band.low_hz, band.high_hz)),
                "power_to_floor": json_number(band.ratio),
                "p_value": json_number(band.p_value),
            }
            for band in seen.spectrum.bands
        ],
        "response_p_values": {
            name: {"retuned": json_number(each.p_before), "augmented": json_number(each.p_after)}
            for name, each in seen.responses.items()
        },
        "pictures": [_picture(picture) for picture in seen.pictures],
    }


def _picture(picture: LawPicture) -> Json:
    arrays = {"x": picture.x, "data": picture.data, "low": picture.low, "high": picture.high, "law": picture.law}
    return {
        "name": picture.name,
        "element": picture.element.value,
        "signal": picture.signal,
        "signal_unit": picture.signal_unit,
        "unit": picture.unit,
        **{name: _numbers(values) for name, values in arrays.items()},
    }


def _effect(effect: FoundEffect) -> Json:
    content = {
        "name": effect.name,
        **({"form": effect.form} if effect.form else {}),
        "element": effect.element.value,
        "statement": effect.statement,
        "parameters": {name: _estimated(value) for name, value in effect.parameters.items()},
        "time_s": _times(effect.time_s),
        "indistinguishable_from": list(effect.indistinguishable_from),
        "alternatives": {
            name: {key: json_number(value) for key, value in values.items()}
            for name, values in effect.alternatives.items()
        },
        "share": json_number(effect.share),
        "probability": json_number(effect.probability),
        "evidence": _evidence(effect.evidence),
    }
    if effect.profiles:
        content["profiles"] = {name: _profile(profile) for name, profile in effect.profiles.items()}
    return content


def _estimated(estimated: Estimated) -> Json:
    return {
        "value": json_number(estimated.value),
        "ci95": _numbers(estimated.ci95),
        "unit": estimated.unit,
    }


def _retuned(parameter: Retuned) -> Json:
    return {
        "nominal": json_number(parameter.nominal),
        "value": json_number(parameter.value),
        "ci95": _numbers(parameter.ci95),
        "unit": parameter.unit,
    }


def _evidence(evidence: Evidence) -> Json:
    return {
        "delta_bic": json_number(evidence.delta_bic),
        "holdout_rms_before": json_number(evidence.holdout_rms_before),
        "holdout_rms_after": json_number(evidence.holdout_rms_after),
        "p_value": json_number(evidence.p_value),
    }


def _profile(profile: Profile) -> Json:
    return {
        "time_s": _numbers(profile.time_s),
        "value": _numbers(profile.value),
        "low": _numbers(profile.low),
        "high": _numbers(profile.high),
        "unit": profile.unit,
    }


def _rejected(rival: RejectedEffect) -> Json:
    return {"name": rival.name, "reason": rival.reason, "delta_bic": json_number(rival.delta_bic)}


def _fit(fit: Fit) -> Json:
    return {
        "unit": fit.unit,
        "nominal": json_number(fit.nominal),
        "retuned": json_number(fit.retuned),
        "augmented": json_number(fit.augmented),
        "holdout_retuned": json_number(fit.holdout_retuned),
        "holdout_augmented": json_number(fit.holdout_augmented),
        "noise_floor": json_number(fit.noise_floor),
        "outputs": [_output(each) for each in fit.outputs],
    }


def _output(each: OutputFit) -> Json:
    figures = {name: json_number(getattr(each, name)) for name in ("retuned", "augmented", "noise")}
    return {"column": each.name, "kind": each.kind, "at": each.at, "unit": each.unit, **figures}
