"""``diagnosis.json`` (CONTRACT, schema ``hil.diagnosis/1``): a Diagnosis for scripts.

Keys beyond the contract: ``warnings``, ``load_torque`` per recording, ``unnamed`` (the law without a name where nothing
explains the mismatch, in short), ``profiles`` in an effect that was found as a course over time, and ``discrepancy``:
the law without a name, the likelihood of each place, and the tests over frequency; ``strays``: nominal values that
alone would explain the mismatch, beyond what they are trusted to.
"""

from __future__ import annotations

import json
from typing import Any

from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Fit,
    FoundEffect,
    UnnamedTable,
    UntestableEffect,
    Verdict,
)
from hil.provenance import Provenance
from hil.report.numbers import as_json, fields_as_json, json_number

SCHEMA = "hil.diagnosis/1"

Json = dict[str, Any]


def diagnosis_text(diagnosis: Diagnosis, made: Provenance | None = None) -> str:
    """Return the text of diagnosis.json."""
    content = diagnosis_json(diagnosis) | ({} if made is None else {"made": made.document()})
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def diagnosis_json(diagnosis: Diagnosis) -> Json:
    """Return the content of the file; a number that is not finite is None."""
    seen, remainder, law = diagnosis.discrepancy, diagnosis.remainder, _law(diagnosis.table)
    return {
        "schema": SCHEMA,
        "doubts": [fields_as_json(each, "about", "statement", "odds", "line") for each in diagnosis.doubts],
        **fields_as_json(diagnosis, "verdict", "statement", "mismatch"),
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "rejected": as_json(diagnosis.rejected),
        "untestable": [_untestable(entry) for entry in diagnosis.untestable],
        "unnamed": law if diagnosis.verdict is Verdict.UNEXPLAINED else None,
        "fit": _fit(diagnosis.fit),
        **fields_as_json(diagnosis, "parameters", "load_torque", "timing_s", "warnings"),
        "discrepancy": None if seen is None else _discrepancy(seen, law),
        "strays": [
            {"parameter": value.name} | fields_as_json(value, "ratio", "tolerance") for value in diagnosis.off_nominal
        ],
        "remainder": None
        if remainder is None
        else fields_as_json(remainder, "share", "times_noise", "element", "band_hz", "law"),
        "tables": {} if diagnosis.table is None else {diagnosis.table.place: _table(diagnosis.table)},
        "traces": as_json(diagnosis.slight),
        "refinements": as_json(diagnosis.refinements),
        "effort": fields_as_json(diagnosis.effort, "level", "simulations", "finished", "untried", "sets"),
    }


def _effect(effect: FoundEffect) -> Json:
    return {
        "name": effect.name,
        **({"form": effect.form} if effect.form else {}),
        **fields_as_json(
            effect, "element", "statement", "parameters", "time_s", "indistinguishable_from", "alternatives", "share",
            "probability", "evidence", "necessity", "least_necessity",
        ),
        "counted": None if effect.counted is None else fields_as_json(effect.counted, "right", "of"),
        **({"profiles": as_json(effect.profiles)} if effect.profiles else {}),
    }  # fmt: skip


def _untestable(entry: UntestableEffect) -> Json:
    return fields_as_json(entry, "name", "reason", "suggested_test", *(["needs"] if entry.needs else []))


def _law(table: UnnamedTable | None) -> Json | None:
    """Return a law without a name in short: its one term is the curve, its coefficient the largest torque in it."""
    if table is None:
        return None
    term = {"law": f"a curve over {table.over}", "coefficient": json_number(max(map(abs, table.values)))}
    return {"element": table.element.value, "terms": [term], **fields_as_json(table, "rms_before", "rms_after")}


def _table(table: UnnamedTable) -> Json:
    return fields_as_json(
        table, "element", "over", "unit", "knots", "values", "ci95", "slope", "reached", "rms_before",
        "rms_after", "looks_like", "formula", "rival", "not_carried",
    )  # fmt: skip


def _fit(fit: Fit) -> Json:
    figures = ("nominal", "retuned", "augmented", "holdout_retuned", "holdout_augmented", "noise_floor")
    of_output = ("kind", "at", "unit", "retuned", "augmented", "noise")
    outputs = [{"column": each.name} | fields_as_json(each, *of_output) for each in fit.outputs]
    return fields_as_json(fit, "unit", *figures) | {"outputs": outputs}


def _discrepancy(seen: Discrepancy, law: Json | None) -> Json:
    """Return what a script may want of the report's pictures: tests and laws, not courses over time."""
    return {
        "element": as_json(seen.element),
        "laws": [] if law is None else [law],
        "places": [fields_as_json(each, "place", "unit", "log_likelihood", "plausible") for each in seen.equivalents],
        "bands": [
            {
                "band_hz": as_json((band.low_hz, band.high_hz)),
                "power_to_floor": json_number(band.ratio),
                "p_value": json_number(band.p_value),
            }
            for band in seen.spectrum.bands
        ],
        "response_p_values": {
            name: {"retuned": json_number(each.p_before), "augmented": json_number(each.p_after)}
            for name, each in seen.responses.items()
        },
        "pictures": [
            fields_as_json(each, "name", "element", "signal", "signal_unit", "unit", "x", "data", "low", "high", "law")
            for each in seen.pictures
        ],
    }
