"""``report.html`` and the terminal's tables of ``hil identify``: what was identified, and how sure it is.

From the top: the result in a paragraph with its warnings, the numbers of every recording, the drive behind them, all
recordings over one another, and for each its frequency response, poles and zeros, residual tests, free run and course.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import RenderableType

from estimator.identification.identify import Compared, Study
from estimator.identification.joint import Together
from estimator.identification.modes.modes import Mode, UncertainRoot
from estimator.identification.offline.validation import CorrelationTest, OrderChoice
from estimator.identification.online.recursive import Status
from estimator.signals.record import FloatArray
from hil.figures.local_model import LocalModel
from hil.figures.palette import BLACK, BLUE, GREEN, VERMILION, series_colour
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.bode import response_figure, responses_figure
from hil.report.figures import Curve, Panel, Style, time_figure
from hil.report.identification_figures import PoleSet, course_figure, known_sets, pole_figure, residual_figure
from hil.report.identification_wording import (
    best_statement,
    headline,
    joint_statement,
    plus_minus,
    statement,
    verdict,
    warnings,
)
from hil.report.made import facts, made_section
from hil.report.numbers import shown, shown_interval, shown_p
from hil.report.terminal import rendered

PHYSICAL = (
    "The two-mass drive, at the motor shaft, that has the response of the third-order Box-Jenkins model. "
    "Sums are often known where their parts are not. Grey: these recordings do not determine the value."
)

FOOTER = (
    "hil identify. High-passed and decimated; errors and fits are those of free-run simulations: measured torque in, "
    "nothing fed back. Intervals hold the truth with 95 % probability."
)

MOST_DRAWN = 12
"""Recordings with a section of their own; the tables hold all."""

LARGEST_REGION = 1.0
"""Regions wider than this in z say only that the data know nothing of the root; they would hide the others."""

MOST_CANDIDATES = 8
"""Structures shown of an order selection."""


def recording_section(model: LocalModel, study: Study, number: int) -> html.Section:
    """Return the section; ``number`` makes its figures' names unique in the page."""
    return html.section(
        f"Recording {model.name}",
        html.paragraph(best_statement(study)),
        html.paragraph(study.validation.statement),
        *_regional(study),
        html.Heading("Frequency response"),
        html.note(_spectral(study)),
        response_figure(f"response-{number}", model, study.best.fit),
        html.Heading("Poles and zeros"),
        *_roots(model, study, number),
        html.Heading("Free run of the output-error model"),
        _free_run(study, number),
        html.Heading("Residual tests"),
        _tests(study),
        residual_figure(f"residuals-{number}", study.validation),
        html.Heading("Course of the on-line estimate"),
        course_figure(f"course-{number}", study.course, model),
    )


def _spectral(study: Study) -> str:
    """Say which samples the spectral estimate is of, or why there is none."""
    spectral = study.found.spectral
    if spectral is None:
        return f"No spectral estimate. {study.found.no_spectral}"
    bridged = f", {spectral.bridged_samples} missing ones bridged" if spectral.bridged_samples else ""
    samples = f"{spectral.used_samples} of {study.found.offline.okay.size} samples{bridged}"
    if spectral.distortion is None:
        return f"Frequency response without a model, from {samples}: fits over {spectral.n_averages:.0f} lines."
    levels = " and ".join(
        f"{name} {shown(level)} (p = {p_value:.2g})"
        for name, (level, p_value) in (
            ("even", spectral.distortion.level(even=True)),
            ("odd", spectral.distortion.level(even=False)),
        )
    )
    return (
        f"Frequency response without a model, from {samples}: mean of {spectral.n_averages:.0f} periods, at "
        f"{spectral.frequency_hz.size} lines. Distortion, the output's amplitude at a line without torque: {levels}; "
        f"noise {shown(spectral.distortion.noise_rms)}."
    )


def _regional(study: Study) -> list[Any]:
    """Return the table of what the resonance depends on; nothing where the drive is linear."""
    if not study.best.regions:
        return []
    rows = [
        (
            f"{one.low:.0f} to {one.high:.0f}",
            "none" if one.mode is None else shown(one.mode.frequency_hz),
            "" if one.mode is None else shown(one.mode.damping),
        )
        for one in study.best.regions
    ]
    return [
        html.Heading("What the resonance depends on"),
        html.table(("torque in the shaft [Nm]", "[Hz]", "damping"), rows),
    ]


def _roots(model: LocalModel, study: Study, number: int) -> list[Any]:
    offline, best = study.found.batch.model, study.best.fit.model
    third = study.third_order.model
    k = model.online.sample_time_s / offline.sample_time_s  # a pole sampled k times as slowly is its k-th power
    sets = [
        PoleSet("best: Box-Jenkins", best.poles**k, best.zeros**k, BLACK),
        PoleSet("on line", model.online.poles, model.online.zeros, BLUE),
        PoleSet("output error, 95 %", offline.poles**k, offline.zeros**k, VERMILION, regions=_regions(study, k)),
        PoleSet("output error, third order", third.poles**k, third.zeros**k, GREEN, hidden=True),
        *known_sets([model]),
    ]
    cancellations = [html.paragraph(each.statement) for each in study.roots.cancellations]
    bound = shown(study.third_order.largest_error)
    note = (
        f"Crosses are poles, circles zeros, drawn at the on-line model's period, {1e3 * model.online.sample_time_s:g} "
        "ms (exact for poles alone). Outlines: where they are with 95 % confidence, a line for a real one; left "
        f"out where they would cover the map. The third-order equivalent changes the response by {bound} at most."
    )
    return [
        html.note(note),
        *cancellations,
        pole_figure(f"poles-{number}", sets, model.online.sample_time_s),
    ]


def _regions(study: Study, k: float) -> tuple[FloatArray, ...]:
    outlines = [_outline(root, k) for root in (*study.roots.poles, *study.roots.zeros)]
    return tuple(each for each in outlines if np.isfinite(each).all() and np.ptp(each, axis=0).max() < LARGEST_REGION)


def _outline(root: UncertainRoot, k: float) -> FloatArray:
    around = root.ellipse() ** k
    return np.column_stack([around.real, around.imag])


def _free_run(study: Study, number: int) -> list[Any]:
    data, error = study.found.offline, study.validation.own.error
    measured = np.where(data.okay, data.output, np.nan)
    panels = (
        Panel(
            f"{data.kind.value}, high-passed",
            (Curve("measured", measured, Style.MEASURED), Curve("output-error model", measured - error, Style.AFTER)),
        ),
        Panel("error", (Curve("error", error, Style.BEFORE),)),
    )
    return time_figure(f"free-run-{number}", data.time_s, panels, MOST_DRAWN)


def _tests(study: Study) -> html.HtmlTable:
    tests = study.validation
    best, linearity = study.best, study.best.linearity
    past = best.validation.independence
    linear = "none seen: linear" if linearity.is_linear else f"not linear: it depends on {linearity.depends_on}"
    rows = [
        ("output error, with past input", shown_p(tests.independence.p_value), _verdict(tests.independence)),
        (
            "Box-Jenkins, with past input",
            shown_p(past.p_value),
            _verdict(past),
        ),
        ("Box-Jenkins, with later input", shown_p(best.feedback.p_value), _feedback(study)),
        ("Box-Jenkins, with functions of torque and speed", shown_p(linearity.p_value), linear),
        (
            "output error, with itself",
            shown_p(tests.autocorrelation.p_value),
            "shown only: road and load correlate it, which is no fault of the model",
        ),
    ]
    return html.table(("residual of", "p", "result"), rows, numbers=(1,))


def _feedback(study: Study) -> str:
    if not study.feedback.detected:
        return "none seen: the torque does not follow the speed"
    if not study.best.linearity.is_linear:
        return "seen, but a nonlinear drive can cause it, too"
    return "the torque follows the speed"


def _verdict(test: CorrelationTest) -> str:
    good = "independent: the model holds"
    return good if test.is_independent else "dependent: the model misses a part of the response"


def numbers_table(models: Sequence[LocalModel], studies: Sequence[Study]) -> list[Any]:
    """Return resonance and damping on line and off line, and how well the models do, of every recording."""
    headings = (
        "recording",
        "best [Hz]",
        "damping",
        "on line [Hz]",
        "damping",
        "free-run fit",
        "one step",
        "unseen",
        "status",
    )
    rows = [_numbers(each) for each in studies]
    known = [model for model in models if model.reference_mode is not None]
    if known and (mode := known[0].reference_mode) is not None and known[0].reference is not None:
        rows.append((known[0].reference.name, shown(mode.frequency_hz), shown(mode.damping), "", "", "", "", "", ""))
    note = (
        "Best: the Box-Jenkins model. ± is half the 95 % interval. Free-run fit, of the output-error model: 100 % less "
        "the simulation error over the output's own variation; one step ahead uses the measured output and does not "
        "measure a model. Unseen: free run on the others."
    )
    return [html.table(headings, rows, numbers=range(1, 8)), html.note(note)]


def _numbers(each: Study) -> tuple[str, ...]:
    online, best, own = each.found.online_resonance, each.resonance, each.validation.own
    unseen = [run.fit_percent for run in each.validation.unseen]
    return (
        each.name,
        "–" if best is None else plus_minus(best.frequency_hz),
        "–" if best is None else plus_minus(best.damping),
        "–" if online is None else shown(online.frequency_hz),
        "–" if online is None else shown(online.damping),
        shown(own.fit_percent, "%"),
        shown(own.one_step_fit_percent, "%"),
        shown(sum(unseen) / len(unseen), "%") if unseen else "–",
        each.found.estimate.status.value,
    )


def physical_tables(studies: Sequence[Study], together: Together | None = None) -> list[Any]:
    """Return the drive's parameters of every recording: one row each, then what is open and why."""
    rows, warnings, is_open = [], [], []
    drives = [(each.name, each.physical, each.not_physical) for each in studies]
    if together is not None and (joint := together[0]) is not None:
        drives.append(("together", joint.physical, joint.not_physical))
    for recording, physical, reason in drives:
        if physical is None:
            warnings.append(html.warning(f"{recording}: no two-mass drive. {reason}"))
            continue
        both = {**physical.parameters, **physical.sums}
        rows += [
            html.HtmlRow(
                (
                    recording,
                    name,
                    shown(one.estimate.value),
                    shown_interval(one.estimate.ci95),
                    one.unit,
                    "determined" if one.is_determined else "open",
                ),
                "" if one.is_determined else "undetermined",
            )
            for name, one in both.items()
        ]
        is_open += [html.note(f"{recording}: {one.statement}") for one in both.values() if not one.is_determined]
    headings = ("recording", "parameter", "value", "95 % interval", "unit", "")
    table = html.table(headings, rows, numbers=(2, 3)) if rows else None
    return [table, *warnings, html.details("What is open, and what would determine it", *is_open) if is_open else None]


def orders_table(choice: OrderChoice) -> list[Any]:
    """Return the best structures of an order selection, the chosen one first."""
    columns = (
        ("nA", lambda each: each.orders.na),
        ("nB", lambda each: each.orders.nb),
        ("delay", lambda each: each.orders.nk),
        ("BIC above the best", lambda each: shown(each.criterion)),
        ("RMS of the whitened error", lambda each: shown(each.rms)),
        ("fit on unseen", lambda each: shown(each.unseen_fit_percent, "%")),
    )
    table = html.table_of(choice.candidates[:MOST_CANDIDATES], columns, numbers=range(6))
    return [html.paragraph(choice.statement), table]


def compared_table(compared: Sequence[Compared]) -> list[Any]:
    """Return what several recursive estimators made of the same data, and why one has no estimate."""
    columns = (
        ("recording", lambda each: each.recording),
        ("estimator", lambda each: each.estimator),
        ("frequency [Hz]", lambda each: "–" if each.resonance is None else shown(each.resonance.frequency_hz)),
        ("damping", lambda each: "–" if each.resonance is None else shown(each.resonance.damping)),
        ("free-run fit", lambda each: shown(each.fit_percent, "%")),
        ("status", lambda each: each.status.value),
    )
    reasons = [html.paragraph(f"{each.recording}, {each.estimator}: {each.reason}") for each in compared if each.reason]
    return [html.table_of(compared, columns, numbers=(2, 3, 4)), *reasons]


def identification_page(
    models: Sequence[LocalModel],
    studies: Sequence[Study],
    choice: OrderChoice | None = None,
    compared: Sequence[Compared] = (),
    made: Provenance | None = None,
    together: Together | None = None,
) -> str:
    """Return the HTML of report.html; one study for each of the models."""
    drawn = list(zip(models, studies, strict=True))[:MOST_DRAWN]
    left = len(models) - len(drawn)
    return html.page(
        f"Identification: {headline(studies)}",
        [
            html.header(
                headline(studies),
                [html.paragraph(verdict(each), kind="statement") for each in studies],
                html.paragraph(statement(models, studies)),
                None if together is None else html.paragraph(joint_statement(together)),
                [html.warning(f"Note: {text}") for text in warnings([each.record for each in models], studies)],
                html.tiles(_tiles(studies)),
                facts=facts(made),
            ),
            html.section("Resonance and damping", numbers_table(models, studies)),
            html.section("Physical parameters", html.note(PHYSICAL), physical_tables(studies, together)),
            html.section("Order and delay", orders_table(choice)) if choice is not None else None,
            html.section("Recursive estimators compared", compared_table(compared)) if compared else None,
            _together(models) if len(models) > 1 else None,
            *(recording_section(model, each, number) for number, (model, each) in enumerate(drawn)),
            html.section("More recordings", html.note(f"{left} more are only in the tables.")) if left else None,
            made_section(made),
        ],
        FOOTER,
    )


def _tiles(studies: Sequence[Study]) -> list[tuple[str, str, str]]:
    first = studies[0]
    tiles = []
    if first.resonance is not None:
        mode, online = first.resonance, first.found.online_resonance
        on_line = ("none on line", "none on line")
        if online is not None:
            on_line = (f"on line {shown(online.frequency_hz, 'Hz')}", f"on line {shown(online.damping)}")
        tiles += [
            (f"frequency, {first.name}", plus_minus(mode.frequency_hz, "Hz"), on_line[0]),
            (f"damping, {first.name}", plus_minus(mode.damping), on_line[1]),
        ]
    own = first.validation.own
    tiles.append(("free-run fit", f"{own.fit_percent:.1f} %", f"one step ahead {own.one_step_fit_percent:.1f} %"))
    tiles.append(("recordings", str(len(studies)), "each with models of its own"))
    return tiles


def _together(models: Sequence[LocalModel]) -> html.Section:
    sets = [
        PoleSet(model.name, model.online.poles, model.online.zeros, series_colour(number))
        for number, model in enumerate(models)
    ]
    return html.section(
        "All recordings",
        html.note("Lines: on-line models. Dots: spectral estimates. Click a name to hide it, double click to see it "
                  "alone."),
        html.Heading("Frequency responses"),
        responses_figure("all-responses", models),
        html.Heading("Poles and zeros of the on-line models"),
        pole_figure("all-poles", [*sets, *known_sets(models)], models[0].online.sample_time_s),
    )  # fmt: skip


def summary(studies: Sequence[Study], nominal: Mode | None) -> RenderableType:
    """Return each recording's best and on-line estimate, for a terminal of 80 columns.

    The status of the on-line estimates has a column where one of them is not as it should be.
    """
    wrong = any(each.found.estimate.status is not Status.ESTIMATED for each in studies)
    rows = [
        (
            each.name,
            *_known(each),
            *_shown(each.found.online_resonance),
            each.found.estimate.status.value if wrong else "",
        )
        for each in studies
    ]
    if nominal is not None:
        rows.append(("model file", *_shown(nominal), "", "", ""))
    headings = ("recording", "best [Hz]", "damping", "on line", "damping", "on line is")
    return rendered([html.section("Resonance and damping", html.table(headings, rows, numbers=range(1, 5)))])


def compared_summary(compared: Sequence[Compared]) -> RenderableType:
    """Return what several recursive estimators made of the same data, for a terminal."""
    return rendered([html.section("Recursive estimators", compared_table(compared))])


def _shown(mode: Mode | None) -> tuple[str, str]:
    return ("none", "") if mode is None else (f"{mode.frequency_hz:.2f}", f"{mode.damping:.3f}")


def _known(each: Study) -> tuple[str, str]:
    mode = each.resonance
    return ("none", "") if mode is None else (plus_minus(mode.frequency_hz), plus_minus(mode.damping))
