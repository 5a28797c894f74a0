"""``report.html`` and the terminal's summary of a diagnosis, from one list of sections.

From the top: verdict and statement, the fit in figures, what was recognised in the acquisition, the physics found with
its law over its data, where the mismatch is (place, time, frequency), the recordings with their simulations and errors,
the effects that were rejected and why, those that these tests neither find nor exclude, and the parameters.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from rich.console import RenderableType

from estimator.diagnosis.result import (
    Diagnosis,
    Discrepancy,
    Equivalent,
    Fit,
    FoundEffect,
    Interval,
    Trace,
    Verdict,
)
from estimator.physics.catalogue import EFFECTS, title_of
from estimator.physics.effect import Element
from estimator.signals.record import FloatArray
from hil.provenance import Provenance
from hil.report import page as html, table_figure
from hil.report.discrepancy_figures import course_figure, error_spectrum_figure, law_figure, response_figure
from hil.report.figures import (
    Curve,
    Mark,
    Panel,
    Style,
    band_figure,
    input_lines,
    spectrum_figure,
    stretches_for,
    time_figure,
)
from hil.report.made import facts, made_section
from hil.report.numbers import listed, p_statement, shown, shown_interval, shown_ratio, shown_times
from hil.report.terminal import rendered
from hil.report.wording import (
    CHECKS,
    ELEMENTS,
    PLACES,
    badge,
    belief,
    headline,
    location_rows,
    quantity,
    torque_axis,
    unseen_data,
)

MOST_DRAWN = 20
"""Recordings drawn at most; beyond, those with the largest error of the re-tuned model."""

RETUNED = "nominal re-tuned"
AUGMENTED = "augmented"
KEPT_BACK = "stretches kept back as unseen data"

SIGNIFICANT_P = 0.01

WHOLE = 0.95
"""From this share on, a mismatch is everywhere in a recording."""

FEWEST_ALIKE = 3
"""Rejected effects with the same reason from which on they share a line."""

UNFITTED = "not fitted"
WHY = {UNFITTED: "not fitted: a score test foresees that none of them would make the explanation better by enough"}
"""What is said of many effects at once, of which each has its own figure."""

REJECTED = ("rejected", "why", "ΔBIC to the explanation")

LEAST_RANGE = 0.05
"""Of the nominal value: half the width of a parameter's drawing at least."""


def diagnosis_page(diagnosis: Diagnosis, made: Provenance | None = None, one_in: int = 1) -> str:
    """Return the text of the page; ``one_in`` tells to one in how many samples recordings were thinned."""
    drawn = _drawn(diagnosis.traces)
    seconds = shown(diagnosis.timing_s.get("total", float("nan")), "s")
    return html.page(
        f"Diagnosis: {headline(diagnosis)}",
        [
            html.header(
                headline(diagnosis), *_statement(diagnosis, one_in), _tiles(diagnosis), kind=_kind(diagnosis),
                badge=badge(diagnosis), facts=facts(made),
            ),
            html.section("Fit", *_fit_of(diagnosis)),
            _acquired(diagnosis),
            None if diagnosis.table is None else table_figure.section(diagnosis.table, diagnosis.fit.unit),
            _found(diagnosis),
            _location(diagnosis, [trace for trace in drawn if not trace.holdout]),
            _frequency(diagnosis),
            *_recordings(diagnosis, drawn),
            _rejected_section(diagnosis) if diagnosis.rejected else None,
            html.section("Neither found nor excluded", _untestable(diagnosis)) if diagnosis.untestable else None,
            html.section(
                "Parameters of the model",
                _parameters(diagnosis),
                html.note("Bar: tolerance grey, nominal value as a line, value found as a dot with its interval. Grey "
                          "rows: these recordings do not determine the value."),
            ),
            made_section(made),
        ],
        f"hil diagnose, computed in {seconds}. Errors are those of free-run simulations: measured torque in, "
        "nothing fed back; constant load torque and initial state estimated in each recording.",
    )  # fmt: skip


def diagnosis_summary(diagnosis: Diagnosis) -> RenderableType:
    """Return what a terminal shows of a diagnosis: the verdict first, then what it rests on."""
    found = [html.paragraph(f"{title_of(e.name)}: {said}") for e in diagnosis.effects if (said := belief(e).rstrip())]
    names = listed([trace.name for trace in diagnosis.traces if not trace.holdout])
    return rendered(
        [
            html.header(
                headline(diagnosis), *([html.paragraph(f"Recordings: {names}.")] if names else []),
                *doubts(diagnosis), html.paragraph(diagnosis.statement),
                kind=_kind(diagnosis), badge=badge(diagnosis),
            ),
            *_fit_of(diagnosis),
            _effects(diagnosis.effects, is_main),
            *found,
            _parameters(diagnosis),
            _rejected(diagnosis) if diagnosis.rejected else None,
            _untestable(diagnosis) if diagnosis.untestable else None,
            *(html.warning(f"Note: {text}") for text in diagnosis.warnings),
        ]
    )  # fmt: skip


def doubts(diagnosis: Diagnosis) -> Iterator[html.Paragraph]:
    """Yield what is doubtful about the input, a paragraph each, with the line that cures it."""
    for doubt in diagnosis.doubts:
        line = (" In [signals] write: ", html.Code(doubt.line)) if doubt.line else ()
        yield html.warning(doubt.statement, *line)


def _kind(diagnosis: Diagnosis) -> str:
    """Return what the head of a page looks like: no verdict's colour while the input is in doubt."""
    return "unexplained" if diagnosis.doubts else diagnosis.verdict.value


def _statement(diagnosis: Diagnosis, one_in: int) -> Iterator[html.Paragraph]:
    yield from doubts(diagnosis)
    yield html.paragraph(diagnosis.statement, kind="statement")
    for text in diagnosis.warnings:
        yield html.warning(f"Note: {text}")
    if one_in > 1:
        yield html.note(
            f"One in {one_in} samples was used, with the mean torque in between: the line responds to nothing faster. "
            "All figures and plots are of these samples."
        )


def _tiles(diagnosis: Diagnosis) -> html.Tiles:
    fit = diagnosis.fit
    training = [trace.name for trace in diagnosis.traces if not trace.holdout]
    held_out = len(diagnosis.traces) - len(training)
    before, after = (f"{shown_ratio(each, fit.noise_floor)} noise floor" for each in (fit.retuned, fit.augmented))
    unseen = f"before: {shown(fit.holdout_retuned, fit.unit)}"
    return html.tiles(
        [
            ("error before", shown(fit.retuned, fit.unit), f"model re-tuned, {before}"),
            ("error after", shown(fit.augmented, fit.unit), f"augmented model, {after}"),
            ("on unseen data", shown(fit.holdout_augmented, fit.unit), unseen),
            ("recordings", str(len(training)), f"and {held_out} held out" if held_out else KEPT_BACK),
        ]
    )


def _fit_of(diagnosis: Diagnosis) -> Iterator[Any]:
    """Yield the errors in figures, of which data they are, and those of further outputs."""
    yield _fit(diagnosis.fit)
    if said := unseen_data(diagnosis):
        yield html.note(said)
    yield _further_outputs(diagnosis.fit)


def _fit(fit: Fit) -> html.HtmlTable:
    rows = (
        ("nominal, as given", fit.nominal, float("nan"), ""),
        ("nominal, re-tuned", fit.retuned, fit.holdout_retuned, "before"),
        ("augmented", fit.augmented, fit.holdout_augmented, "after"),
        ("noise floor", fit.noise_floor, float("nan"), "floor"),
    )
    largest = max((value for _, value, _, _ in rows if np.isfinite(value)), default=0.0)
    cells = [
        (
            name,
            shown(value),
            shown_ratio(value, fit.noise_floor),
            shown(unseen),
            html.Bar(value / largest if largest > 0 and np.isfinite(value) else 0.0, kind),
        )
        for name, value, unseen, kind in rows
    ]
    headings = ("model", f"RMS error [{fit.unit}]", "to noise floor", f"on unseen data [{fit.unit}]", "")
    return html.table(headings, cells, numbers=(1, 2, 3))


def _further_outputs(fit: Fit) -> html.HtmlTable | None:
    columns = (
        ("further output", lambda each: each.name),
        ("where", lambda each: f"{each.kind} at the {each.at}"),
        ("re-tuned", lambda each: shown(each.retuned, each.unit)),
        ("augmented", lambda each: shown(each.augmented, each.unit)),
        ("noise of its reading", lambda each: shown(each.noise, each.unit)),
        ("augmented to noise", lambda each: shown_ratio(each.augmented, each.noise)),
    )
    return html.table_of(fit.outputs, columns, numbers=(2, 3, 4, 5)) if fit.outputs else None


def is_main(effect: FoundEffect, name: str) -> bool:
    """Tell whether a parameter is one that a law can't do without; those that only shape it stand behind it."""
    entry = EFFECTS.get(effect.name)
    needed = () if entry is None else [each.name for each in entry.parameters if not each.optional]
    return not needed or name in needed or not set(needed) & set(effect.parameters)


def _effects(
    effects: Sequence[FoundEffect], shown_if: Callable[[FoundEffect, str], bool] = lambda _effect, _name: True
) -> html.HtmlTable | None:
    """Return the values of effects, a row each; what is not determined is grey."""
    rows = [
        _determined(
            p.ci95, title_of(effect.name), ELEMENTS[effect.element], html.Code(name), shown(p.value, p.unit),
            shown_interval(p.ci95),
        )
        for effect in effects
        for name, p in effect.parameters.items()
        if shown_if(effect, name)
    ]  # fmt: skip
    return html.table(("found", "element", "parameter", "value", "95 % interval"), rows, (3, 4)) if rows else None


def _determined(ci95: Interval, *cells: Any) -> html.HtmlRow:
    """Return a row, grey where the interval has no end."""
    return html.HtmlRow(cells, "" if all(map(math.isfinite, ci95)) else "undetermined")


def _acquired(diagnosis: Diagnosis) -> html.Section | None:
    """Return what was recognised in the raw data, before any fit, and taken into account."""
    found = [effect for effect in diagnosis.effects if _is_acquired(effect)]
    blocks = [_effect(diagnosis, effect) for effect in found]
    return html.section("Recognised in the recordings themselves", *blocks) if found else None


def _is_acquired(effect: FoundEffect) -> bool:
    return effect.element is Element.ACQUISITION or (effect.name in EFFECTS and EFFECTS[effect.name].recognised)


def _found(diagnosis: Diagnosis) -> html.Section | None:
    effects = [effect for effect in diagnosis.effects if not _is_acquired(effect)]
    return html.section("The physics found", *(_effect(diagnosis, effect) for effect in effects)) if effects else None


def _effect(diagnosis: Diagnosis, effect: FoundEffect) -> Iterator[Any]:
    evidence, entry = effect.evidence, EFFECTS.get(effect.name)
    yield html.Heading(title_of(effect.name), ELEMENTS[effect.element])
    yield html.paragraph(effect.statement)
    if entry:
        yield html.paragraph(entry.law, kind="law")
        yield html.note("Law: ", entry.source, ". In files: ", html.Code(effect.name), ".")
    yield _effects([effect], is_main)
    shaping = _effects([effect], lambda each, name: not is_main(each, name))
    yield None if shaping is None else html.details("Parameters that shape the law", shaping)
    yield _law_pictures(diagnosis, effect.name)
    yield html.paragraph(
        f"{belief(effect)}Evidence: information criterion {_bettered(evidence.delta_bic)}; error on unseen "
        f"data {shown(evidence.holdout_rms_before)} → {shown(evidence.holdout_rms_after)}; "
        f"{p_statement(evidence.p_value)}."
    )
    for name, spans in effect.time_s.items():
        if spans:
            yield html.paragraph(f"Acts in {name}: {shown_times(spans)}.")
    if effect.indistinguishable_from:
        rivals = listed([title_of(name) for name in effect.indistinguishable_from])
        yield html.warning(f"These recordings could as well be explained by {rivals}.")
    for number, (name, profile) in enumerate(effect.profiles.items()):
        yield html.Heading(f"{title_of(effect.name)} over time in {name}")
        axis = f"{title_of(effect.name)} [{profile.unit}]"
        figure = f"profile-{effect.name}-{number}"
        yield band_figure(figure, profile.time_s, profile.value, profile.low, profile.high, axis)


def _bettered(delta_bic: float) -> str:
    return f"better by {shown(delta_bic)}" if not delta_bic < 0.0 else f"worse by {shown(-delta_bic)}"


def _law_pictures(diagnosis: Diagnosis, name: str) -> list[Any]:
    """Return the pictures of one law over its data, with a line on how to read them."""
    seen = diagnosis.discrepancy
    return [
        [
            law_figure(f"law-{number}", picture),
            html.note(
                f"Over {picture.signal}: the line is the law, the points are estimates from the recordings that do "
                "not assume its form. Bars are their 95 % intervals, from the spread between passes."
            ),
        ]
        for number, picture in enumerate(seen.pictures if seen is not None else ())
        if picture.name == name
    ]


def _location(diagnosis: Diagnosis, drawn: Sequence[Trace]) -> html.Section | None:
    """Return where simulation and recordings differ; ``drawn`` are the recordings of the fit that are drawn."""
    mismatch, seen = diagnosis.mismatch, diagnosis.discrepancy
    if not mismatch.detected:
        return None
    check = None
    if diagnosis.verdict is Verdict.UNEXPLAINED and mismatch.element is not None:
        check = html.warning(f"What to check: {CHECKS[mismatch.element]}")
    return html.section(
        "Where simulation and recording differ",
        html.table(("", ""), location_rows(mismatch)),
        check,
        None if seen is None else _places(diagnosis, seen, drawn),
    )


def _worth_marking(trace: Trace, spans: Sequence[Interval]) -> Sequence[Interval]:
    """Return the intervals to shade: none where they are the whole recording, which says nothing."""
    covered = sum(high - low for low, high in spans)
    return spans if covered < WHOLE * float(trace.time_s[-1] - trace.time_s[0]) else ()


def _places(diagnosis: Diagnosis, seen: Discrepancy, drawn: Sequence[Trace]) -> list[Any]:
    names = [trace.name for trace in drawn if all(trace.name in each.courses for each in seen.equivalents)]
    if not names:
        return []
    likeliest_first = sorted(seen.equivalents, key=lambda each: -each.log_likelihood)
    columns = (
        ("place", lambda each: f"{'●' if each.plausible else '○'}\u00a0{PLACES[each.place]}"),
        ("size (RMS)", lambda each: shown(_size(each), each.unit)),
        (
            "log-likelihood, difference to the likeliest place",
            lambda each: shown(likeliest_first[0].log_likelihood - each.log_likelihood),
        ),
    )
    text = (
        "What would have to act at one place to explain the error of the re-tuned model by itself, with its 95 % band. "
        "At the true place a simple input explains it; at the others it must vary wildly and is less likely. "
        "● the likeliest places. A constant shaft torque does not show in the output and decays to zero here."
    )
    marked = {trace.name: _worth_marking(trace, diagnosis.mismatch.time_s.get(trace.name, ())) for trace in drawn}
    return [
        html.Heading("What would have to act, and where"),
        html.note(text),
        html.table_of(likeliest_first, columns, numbers=(1, 2)),
        course_figure("equivalent", seen.equivalents, names, marked, stretches_for(3 * len(names))),
    ]


def _size(equivalent: Equivalent) -> float:
    values = np.concatenate([course.value for course in equivalent.courses.values()])
    return float(np.sqrt(np.mean(values**2)))


def _frequency(diagnosis: Diagnosis) -> html.Section | None:
    seen, unit = diagnosis.discrepancy, diagnosis.fit.unit
    if seen is None:
        return None
    loud = [band for band in seen.spectrum.bands if band.p_value < SIGNIFICANT_P]
    bands = ", ".join(f"{b.low_hz:.3g} to {b.high_hz:.3g} Hz ({shown_ratio(b.ratio, 1.0)})" for b in loud)
    return html.section(
        "Over frequency",
        html.paragraph(
            f"Above the noise floor's power, p < {SIGNIFICANT_P:g} after correction for the number of bands: {bands}."
            if loud
            else "In no band is the error of the re-tuned model above the noise floor beyond chance.",
        ),
        error_spectrum_figure("error-spectrum", seen.spectrum, unit, diagnosis.mismatch.band_hz),
        _responses(diagnosis, seen) if seen.responses else None,
    )


def _responses(diagnosis: Diagnosis, seen: Discrepancy) -> list[Any]:
    unit, axis = diagnosis.fit.unit, torque_axis(diagnosis.augmented.motion)
    of_torque = axis.split("[")[1].rstrip("]")
    tests = [(name, p_statement(each.p_before), p_statement(each.p_after)) for name, each in seen.responses.items()]
    return [
        html.Heading(f"Response from {axis.split(' [')[0]} to {quantity(unit)}"),
        html.note(
            f"The spectral estimate needs no model. Where a model leaves its band, its dynamics are wrong there. "
            f"0 dB is 1 {unit} per {of_torque}."
        ),
        response_figure("response", seen.responses),
        html.table(("p-value of the difference", RETUNED, AUGMENTED), tests, numbers=(1, 2)),
    ]


def _drawn(traces: Sequence[Trace]) -> list[Trace]:
    """Return the recordings that are drawn, in their order."""
    largest = sorted(traces, key=lambda trace: _rms(trace.retuned - trace.measured), reverse=True)[:MOST_DRAWN]
    return [trace for trace in traces if any(trace is each for each in largest)]


def _recordings(diagnosis: Diagnosis, drawn: Sequence[Trace]) -> Iterator[html.Section]:
    for number, trace in enumerate(drawn):
        yield _recording(diagnosis, trace, number, len(drawn))
    left_out = len(diagnosis.traces) - len(drawn)
    if left_out:
        text = f"{left_out} more recordings, with smaller errors of the re-tuned model, are not drawn."
        yield html.section("More recordings", html.note(text))


def _rms(error: FloatArray) -> float:
    finite = error[np.isfinite(error)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0


def _recording(diagnosis: Diagnosis, trace: Trace, number: int, recordings: int) -> html.Section:
    fit = diagnosis.fit
    measured = np.where(trace.okay, trace.measured, np.nan)
    before, after = measured - trace.retuned, measured - trace.augmented
    panels = course_panels(diagnosis, trace)
    shaded = _worth_marking(trace, diagnosis.mismatch.time_s.get(trace.name, ()))
    sample_time_s = float(np.median(np.diff(trace.time_s)))
    kind = "held out" if trace.holdout else "used for the fit"
    marked = " Shaded: where the mismatch is." if shaded else ""
    return html.section(
        f"Recording {trace.name}",
        html.note(
            f"RMS error {shown(_rms(before))} → {shown(_rms(after))} {fit.unit}; {kind}. Drag to zoom, double click "
            f"to go back; the dotted pair of lines is the noise floor.{marked}"
        ),
        time_figure(f"time-{number}", trace.time_s, panels, recordings, [Mark(*each) for each in shaded]),
        html.Heading("Spectrum of the error"),
        spectrum_figure(f"spectrum-{number}", sample_time_s, panels[-1].lines, fit.unit, fit.noise_floor),
    )


def course_panels(diagnosis: Diagnosis, trace: Trace) -> tuple[Panel, ...]:
    """Return torques, measured and simulated outputs, and the errors of a recording."""
    fit = diagnosis.fit
    measured = np.where(trace.okay, trace.measured, np.nan)
    errors = [Curve(RETUNED, measured - trace.retuned, Style.BEFORE)]
    models = [Curve(RETUNED, trace.retuned, Style.BEFORE)]
    if not np.array_equal(trace.retuned, trace.augmented):
        errors.append(Curve(AUGMENTED, measured - trace.augmented, Style.AFTER))
        models.append(Curve(AUGMENTED, trace.augmented, Style.AFTER))
    seen = Curve("measured", measured, Style.MEASURED)
    given = Curve("nominal as given", trace.nominal, Style.NOMINAL, hidden=True)
    return (
        Panel(torque_axis(diagnosis.augmented.motion), input_lines(trace.torque_nm)),
        Panel(f"{quantity(fit.unit)} [{fit.unit}]", (seen, given, *models)),
        Panel(f"error [{fit.unit}]", tuple(errors), band=fit.noise_floor),
    )


def _rejected_section(diagnosis: Diagnosis) -> html.Section:
    rows = [(title_of(each.name), each.reason, shown(each.delta_bic)) for each in diagnosis.rejected]
    short = _rejected(diagnosis)
    everyone = html.details("Each of them", html.table(REJECTED, rows, numbers=(2,)))
    return html.section("Rejected effects", short, everyone if len(short.rows) < len(rows) else None)


def _rejected(diagnosis: Diagnosis) -> html.HtmlTable:
    """Return why effects were rejected; many with one reason share a line, and those that were not fitted one."""
    reasons = [UNFITTED if each.reason.startswith(UNFITTED) else each.reason for each in diagnosis.rejected]
    counts = Counter(reasons)
    alike = {reason for reason, count in counts.items() if count >= FEWEST_ALIKE}
    pairs = zip(diagnosis.rejected, reasons, strict=True)
    rows = [(title_of(e.name), e.reason, shown(e.delta_bic)) for e, reason in pairs if reason not in alike]
    rows += [(f"{counts[reason]} others tested, none better", WHY.get(reason, reason), "") for reason in sorted(alike)]
    return html.table(REJECTED, rows, numbers=(2,))


def _untestable(diagnosis: Diagnosis) -> html.HtmlTable:
    rows = [(title_of(entry.name), entry.reason, entry.cure) for entry in diagnosis.untestable]
    return html.table(("neither found nor excluded", "why", "what would show it"), rows)


def _parameters(diagnosis: Diagnosis) -> html.HtmlTable:
    rows = []
    for name, p in diagnosis.parameters.items():
        known = diagnosis.augmented.parameters.get(name)
        bar = interval_bar(p.nominal, p.value, *p.ci95, known.tolerance if known is not None else 0.0)
        change = f"{100 * (p.value / p.nominal - 1):+.1f} %" if p.nominal else "–"
        rows.append(
            _determined(p.ci95, name, shown(p.nominal), shown(p.value), shown_interval(p.ci95), change, p.unit, bar)
        )
    for name, load in diagnosis.load_torque.items():
        cells = (f"constant load in {name}", "–", shown(load.value), shown_interval(load.ci95), "–", load.unit, "")
        rows.append(_determined(load.ci95, *cells))
    found = "found" if diagnosis.table is None else "found, without the law"  # next to it the model has others
    headings = ("parameter", "nominal", found, "95 % interval", "change", "unit", "")
    return html.table(headings, rows, numbers=(1, 2, 3, 4))


def interval_bar(nominal: float, value: float, low: float, high: float, tolerance: float) -> html.IntervalBar | str:
    """Return a drawing relative to the nominal value; "" where that is zero or the value is not known."""
    if nominal == 0.0 or not math.isfinite(value):
        return ""
    found = value / nominal - 1.0
    ends = sorted(each / nominal - 1.0 if math.isfinite(each) else found for each in (low, high))
    reach = 1.2 * max(tolerance, LEAST_RANGE, abs(found), *(abs(each) for each in ends))

    def x(share: float) -> float:
        return 50.0 * (1.0 + share / reach)

    label = f"{100 * found:+.1f} % of nominal, interval {100 * ends[0]:+.1f} to {100 * ends[1]:+.1f} %"
    return html.IntervalBar(label, (x(-tolerance), x(tolerance)), (x(ends[0]), x(ends[1])), x(found))
