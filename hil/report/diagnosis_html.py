"""``report.html``: a diagnosis as one self-contained page.

From the top: verdict and statement, the fit in figures, what was recognised in the acquisition, the physics found with
its law over its data, where the mismatch is (place, time, frequency), the recordings with their simulations and errors,
the effects that were rejected and why, those that these tests neither find nor exclude, and the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from estimator.diagnosis.result import Diagnosis, Fit, FoundEffect, Trace, UnnamedLaw
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.signals.record import FloatArray
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.discrepancy_html import frequency, law_pictures, location, worth_marking
from hil.report.figures import (
    Line,
    Panel,
    Style,
    band_figure,
    input_lines,
    spectrum_figure,
    time_figure,
)
from hil.report.interval_bar import interval_bar
from hil.report.made import made_section
from hil.report.numbers import p_statement, shown, shown_interval, shown_ratio, shown_times
from hil.report.sentence import listed
from hil.report.wording import BADGES, ELEMENTS, belief, headline, quantity, torque_axis

MOST_DRAWN = 20
"""Recordings drawn at most; beyond, those with the largest error of the re-tuned model."""

RETUNED = "nominal re-tuned"
AUGMENTED = "augmented"
KEPT_BACK = "stretches kept back as unseen data"


def diagnosis_page(diagnosis: Diagnosis, made: Provenance | None = None, one_in: int = 1) -> str:
    """Return the text of the page; ``one_in`` tells to one in how many samples recordings were thinned."""
    drawn = _drawn(diagnosis.traces)
    body = [
        _top(diagnosis, one_in),
        _fit(diagnosis),
        _acquired(diagnosis),
        _found(diagnosis),
        location(diagnosis, [trace for trace in drawn if not trace.holdout]),
        frequency(diagnosis),
        *_recordings(diagnosis, drawn),
        _rivals(diagnosis),
        _untestable(diagnosis),
        _parameters(diagnosis),
        made_section(made),
    ]
    seconds = shown(diagnosis.timing_s.get("total", float("nan")), "s")
    return html.page(
        f"Diagnosis: {headline(diagnosis)}",
        (piece for piece in body if piece),
        f"hil diagnose, computed in {seconds}. Errors are those of free-run simulations: measured torque in, "
        "nothing fed back; constant load torque and initial state estimated in each recording.",
    )


def _top(diagnosis: Diagnosis, one_in: int) -> str:
    verdict, fit = diagnosis.verdict, diagnosis.fit
    training = [trace.name for trace in diagnosis.traces if not trace.holdout]
    held_out = len(diagnosis.traces) - len(training)
    warnings = "".join(html.paragraph(f"Note: {text}", "warning") for text in diagnosis.warnings)
    if one_in > 1:
        warnings += html.paragraph(
            f"One in {one_in} samples was used, with the mean torque in between: the line responds to nothing faster. "
            "All figures and plots are of these samples.",
            "note",
        )
    figures = html.tiles(
        [
            (
                "error before",
                shown(fit.retuned, fit.unit),
                f"model re-tuned, {shown_ratio(fit.retuned, fit.noise_floor)} noise floor",
            ),
            (
                "error after",
                shown(fit.augmented, fit.unit),
                f"augmented model, {shown_ratio(fit.augmented, fit.noise_floor)} noise floor",
            ),
            (
                "on unseen data",
                shown(fit.holdout_augmented, fit.unit),
                f"before: {shown(fit.holdout_retuned, fit.unit)}",
            ),
            ("recordings", str(len(training)), f"and {held_out} held out" if held_out else KEPT_BACK),
        ]
    )
    return (
        f'<header class="top {verdict.value}">\n'
        f'<span class="badge {verdict.value}">{BADGES[verdict]}</span>\n'
        f"<h1>{escape(headline(diagnosis))}</h1>\n"
        + html.paragraph(diagnosis.statement, "statement")
        + warnings
        + figures
        + "\n</header>"
    )


def _fit(diagnosis: Diagnosis) -> str:
    fit = diagnosis.fit
    rows = (
        ("nominal, as given", fit.nominal, float("nan"), ""),
        ("nominal, re-tuned", fit.retuned, fit.holdout_retuned, "before"),
        ("augmented", fit.augmented, fit.holdout_augmented, "after"),
        ("noise floor", fit.noise_floor, float("nan"), "floor"),
    )
    largest = np.nanmax([value for _, value, _, _ in rows])
    cells = [
        [
            escape(name),
            shown(value),
            shown_ratio(value, fit.noise_floor),
            shown(unseen),
            html.bar(value / largest if largest > 0 and np.isfinite(value) else 0.0, kind),
        ]
        for name, value, unseen, kind in rows
    ]
    headings = ("model", f"RMS error [{fit.unit}]", "to noise floor", f"on unseen data [{fit.unit}]", "")
    table = html.html_table(headings, cells, numbers=(1, 2, 3))
    return html.section("Fit", table + _further_outputs(fit) if fit.outputs else table)


def _further_outputs(fit: Fit) -> str:
    headings = ("further output", "where", "re-tuned", "augmented", "noise of its reading", "augmented to noise")
    cells = [
        [
            escape(each.name),
            escape(f"{each.kind} at the {each.at}"),
            *(shown(value, each.unit) for value in (each.retuned, each.augmented, each.noise)),
            shown_ratio(each.augmented, each.noise),
        ]
        for each in fit.outputs
    ]
    return html.html_table(headings, cells, numbers=(2, 3, 4, 5))


def _acquired(diagnosis: Diagnosis) -> str:
    """Return what was recognised in the raw data, before any fit, and taken into account."""
    found = [effect for effect in diagnosis.effects if _is_acquired(effect)]
    if not found:
        return ""
    pieces = [piece for effect in found for piece in _effect(diagnosis, effect)]
    return html.section("Recognised in the recordings themselves", *pieces)


def _is_acquired(effect: FoundEffect) -> bool:
    return effect.element is Element.ACQUISITION or (effect.name in EFFECTS and EFFECTS[effect.name].recognised)


def _found(diagnosis: Diagnosis) -> str:
    if diagnosis.unnamed is not None:
        return _unnamed(diagnosis, diagnosis.unnamed)
    effects = [effect for effect in diagnosis.effects if not _is_acquired(effect)]
    if not effects:
        return ""
    pieces = [piece for effect in effects for piece in _effect(diagnosis, effect)]
    return html.section("The physics found", *pieces)


def _unnamed(diagnosis: Diagnosis, law: UnnamedLaw) -> str:
    unit = diagnosis.fit.unit
    rows = [(name, shown(coefficient)) for name, coefficient in law.terms]
    return html.section(
        "A law without a name",
        html.paragraph(
            f"At the {ELEMENTS[law.element]} these terms follow the mismatch best; with them the error falls from "
            f"{shown(law.rms_before, unit)} to {shown(law.rms_after, unit)}. It is a description, not a cause."
        ),
        html.table(("term", "coefficient, or RMS where it has several"), rows, numbers=(1,)),
        *_pictures_at(diagnosis, law.element),
    )


def _pictures_at(diagnosis: Diagnosis, element: Element) -> list[str]:
    seen = diagnosis.discrepancy
    names = [picture.name for picture in seen.pictures if picture.element is element] if seen is not None else []
    return [piece for name in names for piece in law_pictures(diagnosis, name)]


def _effect(diagnosis: Diagnosis, effect: FoundEffect) -> list[str]:
    evidence = effect.evidence
    pieces = [
        f"<h3>{escape(effect.name)} <small>({ELEMENTS[effect.element]})</small></h3>",
        html.paragraph(effect.statement),
    ]
    if entry := EFFECTS.get(effect.name):
        pieces += [html.paragraph(entry.law, "law"), html.paragraph(f"Law: {entry.source}", "note")]
    if effect.parameters:
        rows = [(name, shown(p.value), shown_interval(p.ci95), p.unit) for name, p in effect.parameters.items()]
        pieces.append(html.table(("parameter", "value", "95 % interval", "unit"), rows, numbers=(1, 2)))
    pieces += law_pictures(diagnosis, effect.name)
    pieces.append(
        html.paragraph(
            f"{belief(effect)}Evidence: information criterion {_bettered(evidence.delta_bic)}; error on unseen "
            f"data {shown(evidence.holdout_rms_before)} → {shown(evidence.holdout_rms_after)}; "
            f"{p_statement(evidence.p_value)}."
        )
    )
    pieces += [
        html.paragraph(f"Acts in {name}: {shown_times(spans)}.") for name, spans in effect.time_s.items() if spans
    ]
    if effect.indistinguishable_from:
        rivals = listed(effect.indistinguishable_from)
        pieces.append(html.paragraph(f"These recordings could as well be explained by {rivals}.", "warning"))
    for number, (name, profile) in enumerate(effect.profiles.items()):
        pieces.append(f"<h3>{escape(effect.name)} over time in {escape(name)}</h3>")
        div = f"profile-{effect.name}-{number}"
        axis = f"{effect.name} [{profile.unit}]"
        pieces.append(band_figure(div, profile.time_s, profile.value, profile.low, profile.high, axis))
    return pieces


def _bettered(delta_bic: float) -> str:
    return f"better by {shown(delta_bic)}" if not delta_bic < 0.0 else f"worse by {shown(-delta_bic)}"


def _drawn(traces: Sequence[Trace]) -> list[Trace]:
    """Return the recordings that are drawn, in their order."""
    largest = sorted(traces, key=lambda trace: _rms(trace.retuned - trace.measured), reverse=True)[:MOST_DRAWN]
    return [trace for trace in traces if any(trace is each for each in largest)]


def _recordings(diagnosis: Diagnosis, drawn: Sequence[Trace]) -> list[str]:
    sections = [_recording(diagnosis, trace, i, len(drawn)) for i, trace in enumerate(drawn)]
    left_out = len(diagnosis.traces) - len(drawn)
    if left_out:
        text = f"{left_out} more recordings, with smaller errors of the re-tuned model, are not drawn."
        sections.append(html.section("More recordings", html.paragraph(text, "note")))
    return sections


def _rms(error: FloatArray) -> float:
    finite = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0


def _recording(diagnosis: Diagnosis, trace: Trace, number: int, recordings: int) -> str:
    fit = diagnosis.fit
    measured = np.where(trace.okay, trace.measured, np.nan)
    before, after = measured - trace.retuned, measured - trace.augmented
    panels = course_panels(diagnosis, trace)
    shaded = worth_marking(trace, diagnosis.mismatch.time_s.get(trace.name, ()))
    sample_time_s = float(np.median(np.diff(trace.time_s)))
    kind = "held out" if trace.holdout else "used for the fit"
    figures = f"RMS error {shown(_rms(before))} → {shown(_rms(after))} {fit.unit}; {kind}."
    marked = " Shaded: where the mismatch is." if shaded else ""
    return html.section(
        f"Recording {trace.name}",
        html.paragraph(
            f"{figures} Drag to zoom, double click to go back; the dotted pair of lines is the noise floor.{marked}",
            "note",
        ),
        time_figure(f"time-{number}", trace.time_s, panels, recordings, shaded),
        "<h3>Spectrum of the error</h3>",
        spectrum_figure(f"spectrum-{number}", sample_time_s, panels[-1].lines, fit.unit, fit.noise_floor),
    )


def course_panels(diagnosis: Diagnosis, trace: Trace) -> tuple[Panel, ...]:
    """Return torques, measured and simulated outputs, and the errors of a recording."""
    fit = diagnosis.fit
    measured = np.where(trace.okay, trace.measured, np.nan)
    before, after = measured - trace.retuned, measured - trace.augmented
    inputs = input_lines(trace.torque_nm)
    errors = [Line(RETUNED, before, Style.BEFORE)]
    models = [Line(RETUNED, trace.retuned, Style.BEFORE)]
    if not np.array_equal(trace.retuned, trace.augmented):
        errors.append(Line(AUGMENTED, after, Style.AFTER))
        models.append(Line(AUGMENTED, trace.augmented, Style.AFTER))
    return (
        Panel(torque_axis(diagnosis.augmented.motion), inputs),
        Panel(
            f"{quantity(fit.unit)} [{fit.unit}]",
            (
                Line("measured", measured, Style.MEASURED),
                Line("nominal as given", trace.nominal, Style.NOMINAL, hidden=True),
                *models,
            ),
        ),
        Panel(f"error [{fit.unit}]", tuple(errors), band=fit.noise_floor),
    )


def _rivals(diagnosis: Diagnosis) -> str:
    if not diagnosis.rejected:
        return ""
    rows = [(rival.name, rival.reason, shown(rival.delta_bic)) for rival in diagnosis.rejected]
    return html.section(
        "Rejected effects",
        html.table(("effect", "why it was rejected", "ΔBIC to the explanation"), rows, numbers=(2,)),
    )


def _untestable(diagnosis: Diagnosis) -> str:
    if not diagnosis.untestable:
        return ""
    rows = [(entry.name, entry.reason, entry.cure) for entry in diagnosis.untestable]
    return html.section("Neither found nor excluded", html.table(("effect", "why", "what would show it"), rows))


def _parameters(diagnosis: Diagnosis) -> str:
    rows = []
    for name, p in diagnosis.parameters.items():
        known = diagnosis.augmented.parameters.get(name)
        bar = interval_bar(p.nominal, p.value, *p.ci95, known.tolerance if known is not None else 0.0)
        cells = (name, shown(p.nominal), shown(p.value), shown_interval(p.ci95), _change(p.nominal, p.value), p.unit)
        rows.append([*map(escape, cells), bar])
    for name, load in diagnosis.load_torque.items():
        cells = (f"constant load in {name}", "–", shown(load.value), shown_interval(load.ci95), "–", load.unit)
        rows.append([*map(escape, cells), ""])
    headings = ("parameter", "nominal", "found", "95 % interval", "change", "unit", "nominal, tolerance and interval")
    return html.section(
        "Parameters of the model",
        html.html_table(headings, rows, numbers=(1, 2, 3, 4)),
        html.paragraph("Bar: tolerance grey, nominal value as a line, value found as a dot with its interval.", "note"),
    )


def _change(nominal: float, value: float) -> str:
    return f"{100 * (value / nominal - 1):+.1f} %" if nominal else "–"
