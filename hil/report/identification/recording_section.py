"""One recording's section of an identification report."""

from __future__ import annotations

import numpy as np

from estimator.identification.modes.uncertainty import UncertainRoot
from estimator.identification.study import Study
from estimator.signals.record import FloatArray
from hil.figures.local_model import LocalModel
from hil.figures.palette import BLUE, GREEN, VERMILION
from hil.report import page as html
from hil.report.figures import Line, Panel, Style, time_figure
from hil.report.identification.course import course_figure
from hil.report.identification.pole_map import PoleSet, known_sets, pole_figure
from hil.report.identification.residuals import residual_figure
from hil.report.identification.responses import response_figure
from hil.report.numbers import shown, shown_p

STRETCHES = 900
"""A signal is drawn with two points in each of so many parts."""

LARGEST_REGION = 1.0
"""Regions wider than this in z say only that the data know nothing of the root; they would hide the others."""


def recording_section(model: LocalModel, study: Study, number: int) -> str:
    """Return the section; ``number`` makes its figures' names unique in the page."""
    return html.section(
        f"Recording {model.name}",
        html.paragraph(study.validation.statement),
        "<h3>Frequency response</h3>",
        response_figure(f"response-{number}", model),
        "<h3>Poles and zeros</h3>",
        *_roots(model, study, number),
        "<h3>Free run of the off-line model</h3>",
        _free_run(study, number),
        "<h3>Residual tests</h3>",
        _tests(study),
        residual_figure(f"residuals-{number}", study.validation),
        "<h3>Course of the on-line estimate</h3>",
        course_figure(f"course-{number}", study.course, model),
    )


def _roots(model: LocalModel, study: Study, number: int) -> list[str]:
    offline = study.found.batch.model
    third = study.third_order.model
    sets = [
        PoleSet("on line", model.online.poles, model.online.zeros, BLUE),
        PoleSet("off line, 95 %", offline.poles, offline.zeros, VERMILION, regions=_regions(study)),
        PoleSet("off line, third order", third.poles, third.zeros, GREEN, hidden=True),
        *known_sets([model]),
    ]
    told = [html.paragraph(each.statement) for each in study.roots.cancellations]
    bound = shown(study.third_order.largest_error)
    note = (
        "Crosses are poles, circles zeros. Outlines: where they are with 95 % confidence, a line for a real one; left "
        f"out where they would cover the map. The third-order equivalent changes the response by {bound} at most."
    )
    return [html.paragraph(note, "note"), *told, pole_figure(f"poles-{number}", sets, model.online.sample_time_s)]


def _regions(study: Study) -> tuple[FloatArray, ...]:
    outlines = [_outline(root) for root in (*study.roots.poles, *study.roots.zeros)]
    return tuple(each for each in outlines if np.isfinite(each).all() and np.ptp(each, axis=0).max() < LARGEST_REGION)


def _outline(root: UncertainRoot) -> FloatArray:
    around = root.ellipse()
    return np.column_stack([around.real, around.imag])


def _free_run(study: Study, number: int) -> str:
    data, error = study.found.data, study.validation.own.error
    measured = np.where(data.okay, data.output, np.nan)
    panels = (
        Panel(
            f"{data.kind.value}, high-passed",
            (Line("measured", measured, Style.MEASURED), Line("off-line model", measured - error, Style.AFTER)),
        ),
        Panel("error", (Line("error", error, Style.BEFORE),)),
    )
    return time_figure(f"free-run-{number}", data.time_s, panels, STRETCHES)


def _tests(study: Study) -> str:
    tests = study.validation
    rows = [
        ("residual with past input", shown_p(tests.independence.p_value), _verdict(tests.independence.is_independent)),
        (
            "residual with itself",
            shown_p(tests.autocorrelation.p_value),
            "shown; road and load colour it, and say nothing against the model",
        ),
    ]
    if study.feedback is not None:
        told = "none seen" if not study.feedback.detected else "the torque follows the speed"
        rows.append(("feedback, at the recording's own period", shown_p(study.feedback.p_value), told))
    return html.table(("test", "p", "result"), rows, numbers=(1,))


def _verdict(is_independent: bool) -> str:
    return "independent: the model holds" if is_independent else "dependent: the model misses a part of the response"
