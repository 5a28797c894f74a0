"""One recording's section of an identification report."""

from __future__ import annotations

from typing import Any

import numpy as np

from estimator.identification.modes.uncertainty import UncertainRoot
from estimator.identification.offline.validation import CorrelationTest
from estimator.identification.study import Study
from estimator.signals.record import FloatArray
from hil.figures.local_model import LocalModel
from hil.figures.palette import BLACK, BLUE, GREEN, VERMILION
from hil.report import page as html
from hil.report.figures import Line, Panel, Style, time_figure
from hil.report.identification.course import course_figure
from hil.report.identification.pole_map import PoleSet, known_sets, pole_figure
from hil.report.identification.residuals import residual_figure
from hil.report.identification.responses import response_figure
from hil.report.identification.wording import best_statement
from hil.report.numbers import shown, shown_p

MOST_DRAWN = 12
"""Recordings with a section of their own; the tables hold all."""

LARGEST_REGION = 1.0
"""Regions wider than this in z say only that the data know nothing of the root; they would hide the others."""


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
    return (
        f"Spectral estimate of {spectral.used_samples} of {study.found.offline.okay.size} samples{bridged}: "
        f"{spectral.n_averages:.0f} independent averages, a line every {spectral.frequency_hz[0]:.2g} Hz."
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
            (Line("measured", measured, Style.MEASURED), Line("output-error model", measured - error, Style.AFTER)),
        ),
        Panel("error", (Line("error", error, Style.BEFORE),)),
    )
    return time_figure(f"free-run-{number}", data.time_s, panels, MOST_DRAWN)


def _tests(study: Study) -> html.Table:
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
