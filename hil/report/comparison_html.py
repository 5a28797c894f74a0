"""``compare.html`` and the terminal's summary: simulations against recordings, several models in one overlay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import RenderableType

from estimator.identification.offline.validation import CorrelationTest
from estimator.physics.model import unit
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.comparison import Comparison, by_output, shown_error, together
from hil.report.figures import MODEL_STYLES, Curve, Panel, Style, input_lines, spectrum_figure, time_figure
from hil.report.identification_figures import correlation_figure
from hil.report.made import facts, made_section
from hil.report.numbers import listed, shown, shown_p
from hil.report.terminal import rendered
from hil.report.wording import quantity, torque_axis

SHOWN_DIFFERENCE = 0.02
"""Share by which errors must differ for one model to be called the better: two digits of what is shown."""

RESIDUALS = (
    "The error of a complete model does not depend on past torque: p is the probability of such a correlation by "
    "chance. Below 0.05 the model misses a part of the response. An error that depends only on its own past is "
    "coloured noise or drift."
)


Compared = Sequence[Sequence[Comparison]]
"""Of each recording the comparisons of all models."""


def comparison_page(comparisons: Compared, made: Provenance | None = None) -> str:
    """Return the HTML of compare.html."""
    models = [each.model for each in comparisons[0]]
    count = len(comparisons)
    title = f"{listed(models)} against {count} recording{'s' if count > 1 else ''}"
    return html.page(
        title,
        [
            html.header(title, html.paragraph(better(comparisons), kind="statement"), _figures(comparisons),
                        facts=facts(made)),
            *(_recording(of_recording, i, count) for i, of_recording in enumerate(comparisons)),
            made_section(made),
        ],
        "hil compare. Free-run simulations: measured torque in, nothing fed back; only constant load torque "
        "and initial state are estimated in each recording.",
    )  # fmt: skip


def comparison_summary(comparisons: Compared) -> RenderableType:
    """Return what a terminal shows: which model is better, and the figures."""
    return rendered([html.paragraph(text) if (text := better(comparisons)) else None, _figures(comparisons)])


def better(comparisons: Compared) -> str:
    """Say which of several models follows the recordings better; "" of one alone."""
    errors = {of_model[0].model: together(of_model) for of_model in zip(*comparisons, strict=True)}
    if len(errors) < 2:
        return ""
    (best, least), (second, more), *_ = sorted(errors.items(), key=lambda item: item[1])
    unit_of = comparisons[0][0].unit
    figures = f"{shown(least, unit_of)} against {shown(more, unit_of)} of {second} (RMS of the free-run error)"
    if not more > least * (1.0 + SHOWN_DIFFERENCE):
        return f"{best} and {second} follow the recordings alike: {figures}."
    won = sum(min(of_recording, key=lambda each: each.rms).model == best for of_recording in comparisons)
    where = "in every recording" if won == len(comparisons) else f"smallest in {won} of {len(comparisons)} recordings"
    return f"{best} follows the recordings better: {figures}, {where}."


def _figures(comparisons: Compared) -> html.HtmlTable:
    """Return a row per recording, model and output, and one of all recordings for each model and output."""
    first, several = comparisons[0][0], len(comparisons[0]) > 1
    rows = [
        (each.record.name, each.model, *_row(each, first.unit))
        for of_recording in comparisons
        for of_model in of_recording
        for each in of_model.outputs
    ]
    if len(comparisons) > 1:
        rows += [
            (" ".join(("together", label)), of[0].model, shown_error(together(of), of[0], first.unit), *[""] * 5)
            for of_model in zip(*comparisons, strict=True)
            for label, of in by_output(of_model).items()
        ]
    headings: tuple[str, ...] = (
        "free run", "model", f"RMS [{first.unit}]", "largest", "fit [%]", f"load [{unit('torque', first.motion)}]",
        "samples", "p, past torque",
    )  # fmt: skip
    if not several:
        headings, rows = (headings[0], *headings[2:]), [(row[0], *row[2:]) for row in rows]
    return html.table(headings, rows, numbers=range(len(headings) - 6, len(headings)))


def _row(each: Comparison, unit_above: str) -> tuple[str, ...]:
    good, size = int(each.record.okay.sum()), each.record.okay.size
    used = str(size) if good == size else f"{good}/{size}"
    load = "" if each.record.label else shown(each.load_torque)
    errors = (shown_error(value, each, unit_above) for value in (each.rms, each.largest))
    return (*errors, shown(each.fit_percent), load, used, shown_p(each.past_input.p_value))


def _recording(of_recording: Sequence[Comparison], number: int, recordings: int) -> html.Section:
    record = of_recording[0].record
    return html.section(
        f"Recording {record.name}",
        time_figure(f"time-{number}", record.time_s, comparison_panels(of_recording), recordings),
        html.Heading("Spectrum of the error"),
        *(
            spectrum_figure(f"spectrum-{number}-{k}", record.sample_time_s, _output_panels(of)[-1].lines, of[0].unit)
            for k, of in enumerate(_each_output(of_recording))
        ),
        html.Heading("Does the error depend on the torque?"),
        html.note(RESIDUALS),
        correlation_figure(f"residual-{number}", _tests(of_recording)),
    )


def _each_output(of_recording: Sequence[Comparison]) -> list[list[Comparison]]:
    """Return a recording's comparisons by output, of the models that simulate it."""
    return list(by_output(of_recording).values())


def comparison_panels(of_recording: Sequence[Comparison]) -> tuple[Panel, ...]:
    """Return torques, then of each output measured and simulated, and the errors of all models."""
    first = of_recording[0]
    outputs = (panel for of in _each_output(of_recording) for panel in _output_panels(of))
    return (Panel(torque_axis(first.motion), input_lines(first.record.torque_nm)), *outputs)


def _output_panels(of_output: Sequence[Comparison]) -> tuple[Panel, Panel]:
    first = of_output[0]
    record = first.record
    name = f"{record.label}: " if record.label else ""
    measured = Curve("measured", np.where(record.okay, record.output, np.nan), Style.MEASURED)
    styles = [MODEL_STYLES[i % len(MODEL_STYLES)] for i in range(len(of_output))]
    pairs = list(zip(of_output, styles, strict=True))
    simulated = [Curve(each.model, each.simulated, style) for each, style in pairs]
    errors = [Curve(each.model, each.error, style) for each, style in pairs]
    return (
        Panel(f"{name}{quantity(first.unit)} [{first.unit}]", (measured, *simulated)),
        Panel(f"{name}error [{first.unit}]", tuple(errors)),
    )


def _tests(of_recording: Sequence[Comparison]) -> list[tuple[str, CorrelationTest]]:
    return [
        (" ".join((f"{each.model}:", each.record.label, "error with the past torque")), each.past_input)
        for of in _each_output(of_recording)
        for each in of
    ]
