"""``compare.html``: simulation against recordings as one self-contained page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from estimator.physics.model import Motion, unit
from hil.report import page as html
from hil.report.comparison import Comparison
from hil.report.figures import (
    Line,
    Panel,
    Style,
    input_lines,
    spectrum_figure,
    stretches_for,
    time_figure,
)
from hil.report.numbers import shown
from hil.report.wording import quantity, torque_axis

MODEL = "simulated"


def comparison_page(model_name: str, motion: Motion, comparisons: Sequence[Comparison]) -> str:
    """Return the text of the page."""
    title = f"{model_name} against {len(comparisons)} recording{'s' if len(comparisons) > 1 else ''}"
    rows = [
        (
            each.record.name,
            shown(each.rms, each.unit),
            shown(each.largest, each.unit),
            shown(each.fit_percent, "%"),
            shown(each.load_torque, unit("torque", motion)),
            f"{int(each.record.okay.sum())} of {each.record.okay.size}",
        )
        for each in comparisons
    ]
    headings = ("recording", "RMS error", "largest error", "NRMSE fit", "load torque", "samples used")
    figures = html.table(headings, rows, numbers=(1, 2, 3, 4, 5))
    top = f'<header class="top">\n<h1>{escape(title)}</h1>\n{figures}\n</header>'
    stretches = stretches_for(len(comparisons))
    sections = [_recording(motion, each, i, stretches) for i, each in enumerate(comparisons)]
    return html.page(
        title,
        [top, *sections],
        "hil compare. Free-run simulations: measured torque in, nothing fed back; only constant load torque "
        "and initial state are estimated in each recording.",
    )


def _recording(motion: Motion, comparison: Comparison, number: int, stretches: int) -> str:
    record = comparison.record
    measured = np.where(record.okay, record.output, np.nan)
    error = Line("error", comparison.error, Style.AFTER)
    panels = (
        Panel(torque_axis(motion), input_lines(record.torque_nm)),
        Panel(
            f"{quantity(comparison.unit)} [{comparison.unit}]",
            (
                Line("measured", measured, Style.MEASURED),
                Line(MODEL, comparison.simulated, Style.AFTER),
            ),
        ),
        Panel(f"error [{comparison.unit}]", (error,)),
    )
    return html.section(
        f"Recording {record.name}",
        time_figure(f"time-{number}", record.time_s, panels, stretches),
        "<h3>Spectrum of the error</h3>",
        spectrum_figure(f"spectrum-{number}", record.sample_time_s, (error,), comparison.unit),
    )
