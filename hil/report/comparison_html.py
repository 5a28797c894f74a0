"""``compare.html``: simulations against recordings as one self-contained page, several models in one overlay."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from estimator.identification.offline.validation import CorrelationTest
from estimator.physics.model import unit
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.comparison import Comparison, by_output, shown_error, together
from hil.report.figures import MODEL_STYLES, Line, Panel, Style, input_lines, spectrum_figure, time_figure
from hil.report.identification.residuals import correlation_figure
from hil.report.made import made_section
from hil.report.numbers import shown, shown_p
from hil.report.wording import quantity, torque_axis

RESIDUALS = (
    "The error of a complete model does not depend on past torque: p is the probability of such a correlation by "
    "chance. Below 0.05 the model misses a part of the response. An error that depends only on its own past is "
    "coloured noise or drift."
)


def comparison_page(comparisons: Sequence[Sequence[Comparison]], made: Provenance | None = None) -> str:
    """Return the text of the page.

    Parameters
    ----------
    comparisons : sequence of sequence of Comparison
        Of each recording those of all models.
    """
    models = [each.model for each in comparisons[0]]
    count = len(comparisons)
    title = f"{' and '.join(models)} against {count} recording{'s' if count > 1 else ''}"
    first = comparisons[0][0]
    rows = [
        (each.record.name, each.model, *_figures(each, first.unit))
        for of_recording in comparisons
        for of_model in of_recording
        for each in of_model.outputs
    ]
    if count > 1:
        rows += [
            (" ".join(("together", label)), of[0].model, shown_error(together(of), of[0], first.unit), *[""] * 5)
            for of_model in zip(*comparisons, strict=True)
            for label, of in by_output(of_model).items()
        ]
    if len(models) == 1:
        rows = [(name, *rest) for name, _, *rest in rows]
    headings = (
        "recording", *(["model"] if len(models) > 1 else []), f"RMS error [{first.unit}]", f"largest [{first.unit}]",
        "NRMSE fit [%]", f"load torque [{unit('torque', first.motion)}]", "samples used", "p, past torque",
    )  # fmt: skip
    figures = html.table(headings, rows, numbers=range(len(headings) - 6, len(headings)))
    top = f'<header class="top">\n<h1>{escape(title)}</h1>\n{figures}\n</header>'
    sections = [_recording(of_recording, i, count) for i, of_recording in enumerate(comparisons)]
    return html.page(
        title,
        [top, *sections, made_section(made)],
        "hil compare. Free-run simulations: measured torque in, nothing fed back; only constant load torque "
        "and initial state are estimated in each recording.",
    )


def _figures(each: Comparison, unit_above: str) -> tuple[str, ...]:
    used = f"{int(each.record.okay.sum())} of {each.record.okay.size}"
    load = "" if each.record.label else shown(each.load_torque)
    errors = (shown_error(value, each, unit_above) for value in (each.rms, each.largest))
    return (*errors, shown(each.fit_percent), load, used, shown_p(each.past_input.p_value))


def _recording(of_recording: Sequence[Comparison], number: int, recordings: int) -> str:
    record = of_recording[0].record
    spectra = [
        spectrum_figure(f"spectrum-{number}-{k}", record.sample_time_s, _output_panels(of)[-1].lines, of[0].unit)
        for k, of in enumerate(_each_output(of_recording))
    ]
    return html.section(
        f"Recording {record.name}",
        time_figure(f"time-{number}", record.time_s, comparison_panels(of_recording), recordings),
        "<h3>Spectrum of the error</h3>",
        *spectra,
        "<h3>Does the error depend on the torque?</h3>",
        html.paragraph(RESIDUALS, "note"),
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
    measured = Line("measured", np.where(record.okay, record.output, np.nan), Style.MEASURED)
    styles = [MODEL_STYLES[i % len(MODEL_STYLES)] for i in range(len(of_output))]
    pairs = list(zip(of_output, styles, strict=True))
    simulated = [Line(each.model, each.simulated, style) for each, style in pairs]
    errors = [Line(each.model, each.error, style) for each, style in pairs]
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
