"""``report.html`` of ``hil identify``: what was identified, how sure it is, and what speaks for and against it.

From the top: the result in a paragraph with its warnings, the numbers of every recording, the drive behind them, all
recordings over one another, and for each its frequency response, poles and zeros, residual tests, free run and course.
"""

from __future__ import annotations

from collections.abc import Sequence

from estimator.identification.offline.orders import OrderChoice
from estimator.identification.study import Compared, Study
from hil.figures.local_model import LocalModel
from hil.figures.palette import series_colour
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.identification.pole_map import PoleSet, known_sets, pole_figure
from hil.report.identification.recording_section import MOST_DRAWN, recording_section
from hil.report.identification.responses import responses_figure
from hil.report.identification.tables import compared_table, numbers_table, orders_table, physical_tables
from hil.report.identification.wording import headline, plus_minus, statement, verdict, warnings
from hil.report.made import facts, made_section
from hil.report.numbers import shown

PHYSICAL = (
    "The two-mass drive, at the motor shaft, that has the response of the third-order Box-Jenkins model. "
    "Sums are often known where their parts are not. Grey: these recordings do not determine the value."
)

FOOTER = (
    "hil identify. High-passed and decimated; errors and fits are those of free-run simulations: measured torque in, "
    "nothing fed back. Intervals hold the truth with 95 % probability."
)


def identification_page(
    models: Sequence[LocalModel],
    studies: Sequence[Study],
    choice: OrderChoice | None = None,
    compared: Sequence[Compared] = (),
    made: Provenance | None = None,
) -> str:
    """Return the text of the page.

    Parameters
    ----------
    models, studies
        Every recording, identified and questioned, in one order.
    choice
        How order and delay were chosen, where they were.
    compared
        Other recursive estimators on the same data.
    """
    drawn = list(zip(models, studies, strict=True))[:MOST_DRAWN]
    left = len(models) - len(drawn)
    return html.page(
        f"Identification: {headline(studies)}",
        [
            html.header(
                headline(studies),
                [html.paragraph(verdict(each), kind="statement") for each in studies],
                html.paragraph(statement(models, studies)),
                [html.warning(f"Note: {text}") for text in warnings(studies)],
                html.tiles(_tiles(studies)),
                facts=facts(made),
            ),
            html.section("Resonance and damping", numbers_table(models, studies)),
            html.section("Physical parameters", html.note(PHYSICAL), physical_tables(studies)),
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
