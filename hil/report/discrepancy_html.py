"""The sections of the report that show a mismatch: where, over time, over frequency, and as a law over its data."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from estimator.diagnosis.result import Diagnosis, Discrepancy, Equivalent, Interval, Trace, Verdict
from hil.report import page as html
from hil.report.discrepancy_figures import course_figure, error_spectrum_figure, law_figure, response_figure
from hil.report.figures import stretches_for
from hil.report.numbers import p_statement, shown, shown_p, shown_ratio
from hil.report.wording import CHECKS, ELEMENTS, PLACES, location_rows, quantity, torque_axis

SIGNIFICANT_P = 0.01

WHOLE = 0.95
"""From this share on, a mismatch is everywhere in a recording."""


def law_pictures(diagnosis: Diagnosis, name: str) -> list[str]:
    """Return the pictures of one law over its data, with a line on how to read them."""
    if diagnosis.discrepancy is None:
        return []
    pieces = []
    for number, picture in enumerate(diagnosis.discrepancy.pictures):
        if picture.name == name:
            text = (
                f"Over {picture.signal}: the line is the law, the points are estimates from the recordings that do "
                "not assume its form. Bars are their 95 % intervals, from the spread between passes."
            )
            pieces += [law_figure(f"law-{number}", picture), html.paragraph(text, "note")]
    return pieces


def location(diagnosis: Diagnosis, drawn: Sequence[Trace]) -> str:
    """Return where simulation and recordings differ; ``drawn`` are the recordings of the fit that are drawn."""
    mismatch, seen = diagnosis.mismatch, diagnosis.discrepancy
    if not mismatch.detected:
        return ""
    pieces = [html.table(("", ""), location_rows(mismatch))]
    if diagnosis.verdict is Verdict.UNEXPLAINED and mismatch.element is not None:
        pieces.append(html.paragraph(f"What to check: {CHECKS[mismatch.element]}", "warning"))
    if seen is not None:
        pieces += [*_places(diagnosis, seen, drawn), *_laws(seen, diagnosis.fit.unit)]
    return html.section("Where simulation and recording differ", *pieces)


def worth_marking(trace: Trace, spans: Sequence[Interval]) -> Sequence[Interval]:
    """Return the intervals to shade: none where they are the whole recording, which tells nothing."""
    covered = sum(high - low for low, high in spans)
    return spans if covered < WHOLE * float(trace.time_s[-1] - trace.time_s[0]) else ()


def _places(diagnosis: Diagnosis, seen: Discrepancy, drawn: Sequence[Trace]) -> list[str]:
    names = [trace.name for trace in drawn if all(trace.name in each.courses for each in seen.equivalents)]
    if not names:
        return []
    most = max(each.log_likelihood for each in seen.equivalents)
    rows = [
        (
            f"{'●' if each.plausible else '○'}\u00a0{PLACES[each.place]}",
            shown(_size(each), each.unit),
            shown(most - each.log_likelihood),
        )
        for each in sorted(seen.equivalents, key=lambda each: -each.log_likelihood)
    ]
    text = (
        "What would have to act at one place to explain the error of the re-tuned model by itself, with its 95 % band. "
        "At the true place a simple input explains it; at the others it must vary wildly and is less likely. "
        "● the likeliest places. A constant shaft torque does not show in the output and decays to zero here."
    )
    marked = {trace.name: worth_marking(trace, diagnosis.mismatch.time_s.get(trace.name, ())) for trace in drawn}
    figure = course_figure("equivalent", seen.equivalents, names, marked, stretches_for(3 * len(names)))
    return [
        "<h3>What would have to act, and where</h3>",
        html.paragraph(text, "note"),
        html.table(("place", "size (RMS)", "log-likelihood behind the best"), rows, numbers=(1, 2)),
        figure,
    ]


def _size(equivalent: Equivalent) -> float:
    values = np.concatenate([course.value for course in equivalent.courses.values()])
    return float(np.sqrt(np.mean(values**2)))


def _laws(seen: Discrepancy, unit: str) -> list[str]:
    if not seen.laws:
        return []
    rows = [
        (
            ELEMENTS[law.element],
            " + ".join(name for name, _ in law.terms),
            shown(law.rms, unit),
            shown(law.delta_bic),
            shown_p(law.p_value),
        )
        for law in seen.laws
    ]
    headings = ("element", "best law without a name there", "would leave", "ΔBIC", "p")
    return ["<h3>Laws without a name, element by element</h3>", html.table(headings, rows, numbers=(2, 3, 4))]


def frequency(diagnosis: Diagnosis) -> str:
    """Return the mismatch over frequency."""
    seen = diagnosis.discrepancy
    if seen is None:
        return ""
    unit = diagnosis.fit.unit
    loud = [band for band in seen.spectrum.bands if band.p_value < SIGNIFICANT_P]
    bands = ", ".join(f"{b.low_hz:.3g} to {b.high_hz:.3g} Hz ({shown_ratio(b.ratio, 1.0)})" for b in loud)
    pieces = [
        html.paragraph(
            f"Above the noise floor's power, p < {SIGNIFICANT_P:g} after correction for the number of bands: {bands}."
            if loud
            else "In no band is the error of the re-tuned model above the noise floor beyond chance.",
        ),
        error_spectrum_figure("error-spectrum", seen.spectrum, unit, diagnosis.mismatch.band_hz),
    ]
    if seen.responses:
        motion = diagnosis.augmented.motion
        of_torque = torque_axis(motion).split("[")[1].rstrip("]")
        tests = [(name, p_statement(each.p_before), p_statement(each.p_after)) for name, each in seen.responses.items()]
        pieces += [
            f"<h3>Response from {escape(torque_axis(motion).split(' [')[0])} to {escape(quantity(unit))}</h3>",
            html.paragraph(
                f"The spectral estimate needs no model. Where a model leaves its band, its dynamics are wrong there. "
                f"0 dB is 1 {unit} per {of_torque}.",
                "note",
            ),
            response_figure("response", seen.responses),
            html.table(("p-value of the difference", "nominal re-tuned", "augmented"), tests, numbers=(1, 2)),
        ]
    return html.section("Over frequency", *pieces)
