"""``report.html`` and ``paper.json`` of ``hil paper``: the paper's figures and their numbers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from estimator.identification.settings import Settings
from hil.figures.local_model import ExperimentRow, LocalModel
from hil.figures.road import Conditions
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.made import facts, made_section
from hil.report.numbers import as_json, shown

SOURCE = (
    "N. Nevaranta, J.-H. Montonen, T. Lindh: Online Estimation of a Mechanical Driveline Parameters of a Hybrid Bus, "
    "EPE'18 ECCE Europe"
)

SCHEMA: Final = "hil.paper/1"


def paper_page(
    models: Sequence[LocalModel],
    rows: Sequence[ExperimentRow],
    driven: Sequence[Conditions],
    folder: Path,
    made: Provenance | None = None,
) -> str:
    """Return the text of the page; in ``folder`` are the printed figures."""
    sections = [
        _top(models, rows, driven, made),
        html.section("Resonance and damping", _numbers(rows)),
        *_figures(folder, models[0].online.orders.na),
        *([html.section("What was driven", *_conditions(models, driven))] if driven else []),
        made_section(made),
    ]
    return html.page("The paper's figures", sections, f"hil paper. After {SOURCE}.")


def _top(
    models: Sequence[LocalModel], rows: Sequence[ExperimentRow], driven: Sequence[Conditions], made: Provenance | None
) -> html.Header:
    count = f"{len(models)} experiment{'s' if len(models) > 1 else ''}"
    first = models[0].found
    orders, reference = first.online.orders, models[0].reference
    how = (
        f"{count} on the simulated rig over CANopen and Modbus, at near-constant speed, each with a payload, road, "
        "wind and driver of its own."
        if driven
        else f"{count} as recorded."
    )
    settings = (
        f"On line: OEFO with nA = {orders.na}, nB = {orders.nb}, total delay {orders.nk}, at "
        f"{1e3 * first.online.sample_time_s:g} ms."
    )
    tiles = [("experiments", str(len(models)), "each a local model of its own")]
    if reference is not None:
        tiles += [
            ("frequency, worst error", _worst(rows, "hz"), f"on line, to the {reference.name}"),
            ("damping, worst error", _worst(rows, "damping"), f"on line, to the {reference.name}"),
        ]
    said = html.paragraph(f"{how} {settings}", kind="statement")
    return html.header(f"The driveline of the paper, from {count}", said, html.tiles(tiles), facts=facts(made))


def _worst(rows: Sequence[ExperimentRow], what: str) -> str:
    errors = np.array([row.error(what, "online") for row in rows])
    missing = int(np.isnan(errors).sum())
    text = f"{100.0 * float(np.nanmax(np.abs(errors))):.2g} %" if missing < errors.size else "–"
    return f"{text}, {missing} without" if missing else text


def _numbers(rows: Sequence[ExperimentRow]) -> list[Any]:
    columns = (
        ("experiment", lambda row: row.name),
        ("on line [Hz]", lambda row: shown(row.online_hz)),
        ("off line [Hz]", lambda row: shown(row.offline_hz)),
        ("reference [Hz]", lambda row: shown(row.reference_hz)),
        ("error", lambda row: _percent(row.error("hz", "online"))),
        ("damping on line", lambda row: shown(row.online_damping)),
        ("off line", lambda row: shown(row.offline_damping)),
        ("reference", lambda row: shown(row.reference_damping)),
        ("error", lambda row: _percent(row.error("damping", "online"))),
        ("to off line [dB]", lambda row: shown(row.offline_db)),
        ("agrees with the spectrum [Hz]", lambda row: _band(row.agrees_hz)),
        ("fit", lambda row: shown(row.fit_percent, "%")),
        ("status", lambda row: row.status),
    )
    note = (
        "Error: of the on-line estimate to the reference. To off line: largest difference of the two models' frequency "
        "responses in the unbroken band around the resonance where the coherence is above 0.9. Agrees: the unbroken "
        "band around the resonance in which on-line model and spectral estimate differ by 3 dB at most. Fit: free run "
        "of the off-line model over the whole recording, after the high-pass."
    )
    return [html.table_of(rows, columns, numbers=range(1, 12)), html.note(note)]


def _band(band_hz: tuple[float, float] | None) -> str:
    return "–" if band_hz is None else f"{band_hz[0]:.2g} to {band_hz[1]:.3g}"


def _percent(share: float) -> str:
    return "–" if np.isnan(share) else f"{100.0 * share:+.2f} %"


def _figures(folder: Path, poles: int) -> Iterator[html.Section]:
    """Yield the printed figures, each with a line on how to read it."""
    for name, title, how in (
        ("fig2", "Fig. 2: total torque and motor speed", "As recorded."),
        (
            "fig4",
            "Fig. 4: on-line models against spectral estimates",
            "To zoom into, hil identify shows the same of any recordings.",
        ),
        (
            "fig5",
            "Fig. 5: poles and zeros",
            f"As identified, nA = {poles}, and their third-order equivalents; what is known is black. Dotted: damping "
            "0.1, 0.3, 0.6. The zeros of a sampled model are only roughly those of the continuous one.",
        ),
    ):
        yield html.section(title, html.note(how), html.Picture((folder / f"{name}.svg").read_text("utf-8"), title))


def _conditions(models: Sequence[LocalModel], driven: Sequence[Conditions]) -> list[Any]:
    headings = (
        "experiment",
        "speed [rad/s]",
        "payload [kg]",
        "slope RMS [%]",
        "head wind [m/s]",
        "surface [Nm]",
        "pedal [Nm]",
    )
    rows = [
        (
            model.name,
            shown(each.speed_rad_s),
            f"{each.payload_kg:+.0f}",
            shown(100.0 * each.slope_rms),
            f"{each.wind_m_s:.1f} ± {each.gust_m_s:.1f}",
            shown(each.roughness_nm),
            shown(each.pedal_nm),
        )
        for model, each in zip(models, driven, strict=True)
    ]
    note = (
        "The paper gives no numbers for these; all are assumed. Payload: to the bus of the rig's model, which carries "
        "some. Surface: RMS of what its unevenness adds to the load torque at the motor shaft; pedal: standard "
        "deviation of the driver's corrections."
    )
    return [html.table(headings, rows, numbers=range(1, 7)), html.note(note)]


def paper_text(
    rows: Sequence[ExperimentRow],
    settings: Settings,
    driven: Sequence[Conditions],
    seed: int | None,
    made: Provenance | None = None,
) -> str:
    """Return the text of the file; ``seed`` is None and ``driven`` empty where recordings were given.

    ``made`` is given with recordings alone: from one seed the same file comes at any time.
    """
    document = {
        "schema": SCHEMA,
        "seed": seed,
        "settings": {
            **as_json(settings.orders),
            "sample_time_s": settings.sample_time_s,
            "samples": settings.samples,
            "high_pass_hz": settings.high_pass_hz,
        },
        "experiments": as_json(rows),
        "conditions": [asdict(each) for each in driven],
        **({} if made is None else {"made": made.document()}),
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"
