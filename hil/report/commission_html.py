"""``commissioning.html``: a commissioning as one self-contained page, as far as it is.

From the top: what it came to, in figures; all steps at a glance; each step with its findings (expected, measured,
within?), its pictures and its runs; what was decided on the way; the rig file. Made from the state file alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from hil.figures.palette import BLUE, GREY, VERMILION, series_colour
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.figures import DECADES, LEGEND_PX, PANEL_PX, Curve, Panel, Style, figure_block, time_figure
from hil.report.identification_figures import PoleSet, pole_figure
from hil.report.made import made_section
from hil.report.numbers import moment, shown

StateDocument = Mapping[str, Any]
Evidence = Mapping[str, Any]

MOST_NAMED = 4
"""Findings outside their limits that the head of the page names."""

MARKS = {True: ("no_mismatch", "✓ within"), False: ("unexplained", "✗ outside"), None: ("", "–")}
"""CSS class and words for within, outside, and no limit: the words say it, not the colour alone."""

STATUSES = {
    "done": ("explained", "done"),
    "skipped": ("", "skipped"),
    "blocked": ("unexplained", "blocked"),
    "interrupted": ("unexplained", "interrupted"),
    "running": ("", "under way"),
    "pending": ("", "to do"),
}

COURSES = 4
"""Figures over time that share the page."""

SPEED = ("speed [rad/s]", [("speed", "speed_rad_s", Style.AFTER)])


def commission_page(state: StateDocument, titles: Mapping[str, str], made: Provenance | None = None) -> str:
    """Return the HTML of a commissioning; ``state`` as commission.json has it, titles by name of the step."""
    steps = state["steps"]
    begun, updated = moment(state["started_utc"]), moment(state["updated_utc"])
    return html.page(
        f"Commissioning of {state['rig_name']}",
        [
            _top(state, updated),
            _overview(steps, titles),
            *(_step(name, titles[name], steps[name]) for name in titles if steps[name]["status"] != "pending"),
            _decisions(state) if state["notes"] else None,
            html.section(
                "The rig file",
                html.note(state["rig_path"]),
                html.details("show it", html.Preformatted(state["rig_text"])),
            ),
            made_section(made),
        ],
        f"hil commission {state['hil_version']}, begun {begun}, as of {updated}. "
        "Intervals are of 95 % confidence; predicted values are from the driveline as it was known before each run.",
    )


def _top(state: StateDocument, updated: str) -> html.Header:
    records = state["steps"].values()
    outside = sum(finding["within"] is False for record in records for finding in record["findings"])
    to_do = [name for name, record in state["steps"].items() if record["status"] not in ("done", "skipped")]
    if to_do:
        kind, words = "unexplained", f"not complete: {len(to_do)} to do, next is {to_do[0]}"
    elif outside:
        kind, words = "explained", f"complete, {outside} outside their limits"
    else:
        kind, words = "no_mismatch", "complete, all within limits"
    return html.header(
        f"Commissioning of {state['rig_name']}",
        (html.paragraph(text, kind="statement") for text in _statements(state)),
        html.tiles(_tiles(state)),
        kind=kind,
        badge=words,
        facts=(("rig", state["rig_name"]), ("rig file", state["rig_path"]), ("as of", updated)),
    )


def _statements(state: StateDocument) -> Iterator[str]:
    found = [state["steps"][name]["evidence"].get("statement") for name in ("solve", "diagnosis")]
    if statement := next(filter(None, found), None):
        yield statement
    outside = [
        f"{finding['what']}: {finding['measured']}"
        for name, record in state["steps"].items()
        for finding in record["findings"]
        if finding["within"] is False and name != "diagnosis"
    ]
    if outside:
        more = f"; and {len(outside) - MOST_NAMED} more" if len(outside) > MOST_NAMED else ""
        yield f"Outside their limits: {'; '.join(outside[:MOST_NAMED])}{more}."


def _tiles(state: StateDocument) -> Iterator[tuple[str, str, str]]:
    evidence = {name: record["evidence"] for name, record in state["steps"].items()}
    resonances = [run["best"]["resonance"] for run in evidence["identification"].get("runs", [])]
    known = [resonance for resonance in resonances if resonance is not None]
    if known:
        frequency, damping = (sum(values) / len(known) for values in zip(*known, strict=True))
        of_runs = f"mean of {len(known)} runs" if len(known) > 1 else "of one run"
        yield "resonance", shown(frequency, "Hz"), of_runs
        yield "damping", f"{damping:.3f}", of_runs
    if "amplitude_nm" in evidence["prbs"]:
        yield "PRBS", f"±{evidence['prbs']['amplitude_nm']:g} Nm", str(evidence["prbs"]["reason"])
    if evidence["scales"].get("gain") and None not in evidence["scales"]["gain"]:
        gain, spread = evidence["scales"]["gain"]
        yield "m2 against m1", f"{100.0 * (gain - 1.0):+.1f} %", f"±{100.0 * spread:.1f} %, for the same reading"
    inertia, spread = evidence["friction"].get("inertia_kg_m2", (None, None))
    if inertia is not None:
        yield "inertia", shown(inertia, "kg m²"), "" if spread is None else f"±{shown(spread)}, at the motor shaft"
    driven_s = sum(run["seconds"] for record in state["steps"].values() for run in record["runs"])
    yield "driven", f"{driven_s / 60.0:.1f} min", "of this and earlier calls, without attempts that were repeated"


def _overview(steps: Mapping[str, Any], titles: Mapping[str, str]) -> html.Section:
    rows = []
    for number, (name, title) in enumerate(titles.items(), start=1):
        record = steps[name]
        within = sum(finding["within"] is True for finding in record["findings"])
        outside = sum(finding["within"] is False for finding in record["findings"])
        counted = f"{within} within" + (f", {outside} outside" if outside else "") if record["findings"] else "–"
        cells = (f"{number} {title}", _badge(record), counted, record["because"] or "–")
        rows.append(html.HtmlRow(cells, "outside" if outside else ""))
    return html.section("Steps", html.table(("step", "status", "findings", "because"), rows))


def _badge(record: Mapping[str, Any]) -> html.Badge:
    kind, words = STATUSES[record["status"]]
    return html.Badge(words, kind)


def _step(name: str, title: str, record: Mapping[str, Any]) -> html.Section:
    runs, history, evidence = record["runs"], record["history"], record["evidence"]
    draw = _FIGURES.get(name)
    return html.section(
        title,
        _status(record),
        html.table(("what", "expected", "measured", "within?"), map(_finding, record["findings"]))
        if record["findings"]
        else None,
        draw(evidence) if draw is not None and evidence else None,
        html.details(f"Runs ({len(runs)}): predicted and measured", _runs(runs)) if runs else None,
        html.details(f"Earlier attempts ({len(history)})", _history(history)) if history else None,
    )


def _status(record: Mapping[str, Any]) -> html.Paragraph:
    because = f" because: {record['because']}" if record["because"] else ""
    when = f" {moment(record['ended_utc'])}" if record["ended_utc"] else ""
    attempt = f", attempt {record['attempt']}" if record["attempt"] > 1 else ""
    return html.paragraph(_badge(record), f" {when}{attempt}{because}")


def _finding(finding: Mapping[str, Any]) -> html.HtmlRow:
    within = finding["within"]
    kind, words = MARKS[within]
    if within is None and finding["expected"] != "–":
        words = "? can't tell"
    has_advice = finding["advice"] and within is not True
    measured = html.Advised(finding["measured"], finding["advice"]) if has_advice else finding["measured"]
    verdict = html.Badge(words, kind) if within is not None else words
    cells = (finding["what"], finding["expected"], measured, verdict)
    return html.HtmlRow(cells, "outside" if within is False else "")


def _runs(runs: Sequence[Mapping[str, Any]]) -> html.HtmlTable:
    columns = (
        ("run", lambda run: run["name"] + ("" if run["whole"] else " (ended early)")),
        ("recording", lambda run: run["recording"] or "none"),
        ("s", lambda run: f"{run['seconds']:.1f}"),
        ("m1 [Nm]", lambda run: _range(run["measured"], "torque_m1_nm", 0)),
        ("predicted", lambda run: _range(run["predicted"], "torque_m1_nm", 0)),
        ("m2 [Nm]", lambda run: _range(run["measured"], "torque_m2_nm", 0)),
        ("predicted", lambda run: _range(run["predicted"], "torque_m2_nm", 0)),
        ("speed [rad/s]", lambda run: _range(run["measured"], "speed_rad_s", 1)),
        ("predicted", lambda run: _range(run["predicted"], "speed_rad_s", 1)),
    )
    return html.table_of(runs, columns, numbers=range(2, len(columns)))


def _range(ranges: Mapping[str, Any], key: str, digits: int) -> str:
    return f"{ranges[key][0]:z.{digits}f} … {ranges[key][1]:z.{digits}f}" if key in ranges else "–"


def _history(history: Sequence[Mapping[str, Any]]) -> html.HtmlTable:
    columns = (
        ("attempt", lambda each: each["attempt"]),
        ("ended as", lambda each: each["status"]),
        ("at", lambda each: moment(each["ended_utc"]) if each["ended_utc"] else ""),
        ("because", lambda each: each["because"]),
        ("outside", lambda each: sum(finding["within"] is False for finding in each["findings"])),
        ("recordings", lambda each: ", ".join(each["recordings"])),
    )
    return html.table_of(history, columns)


def _decisions(state: StateDocument) -> html.Section:
    rows = [(moment(note["at_utc"]), note["what"], note["changes"], note["steps"]) for note in state["notes"]]
    return html.section("Decisions on the way", html.table(("at", "what", "changes", "steps done before"), rows))


def _array(values: Sequence[float | None]) -> np.ndarray:
    return np.array(values, dtype=np.float64)


def _course(name: str, course: Mapping[str, Any], *panels: tuple[str, Sequence[tuple[str, str, Style]]]) -> list[Any]:
    """Draw a course: for each panel its axis, and its lines as (name, key of the course, style)."""
    drawn = [
        Panel(axis, tuple(Curve(line, _array(course[key]), style) for line, key, style in lines))
        for axis, lines in panels
    ]
    return list(time_figure(name, _array(course["time_s"]), drawn, COURSES))


def _noise(evidence: Evidence) -> list[Any]:
    return _course(
        "noise-course",
        evidence["course"],
        ("speed [rad/s]", [("speed at zero torque", "speed_rad_s", Style.AFTER)]),
    )


def _signs(evidence: Evidence) -> list[Any]:
    torque = ("torque [Nm]", [("reading", "reading_nm", Style.MEASURED), ("reference", "reference_nm",
                                                                         Style.FIRST_INPUT)])  # fmt: skip
    return [
        (html.Heading(f"Pulses of {name}"), _course(f"signs-{name}", evidence[name]["course"], torque, SPEED))
        for name in ("m1", "m2")
        if evidence.get(name)
    ]


def _friction(evidence: Evidence) -> list[Any]:
    torque = ("torque [Nm]", [("torque of both", "torque_nm", Style.FIRST_INPUT)])
    return _course("friction-course", evidence["course"], torque, SPEED)


def _identification(evidence: Evidence) -> list[Any]:
    runs = evidence["runs"]
    if not runs:
        return []
    sets = [
        PoleSet(name, _roots(runs, how, "poles"), _roots(runs, how, "zeros"), colour)
        for name, how, colour in (("best off line", "best", BLUE), ("on line, last estimates", "online", VERMILION))
    ]
    return [
        html.Heading("Frequency responses, torque to speed"),
        _responses(runs),
        html.Heading("Resonance of each run"),
        _resonances(runs),
        html.Heading("Poles and zeros"),
        pole_figure("identification-poles", sets, runs[0]["online"]["sample_time_s"]),
    ]


def _roots(runs: list[Evidence], how: str, which: str) -> np.ndarray:
    """Return the roots of all runs at the on-line period: a pole sampled k times as slowly is its k-th power."""
    k = runs[0]["online"]["sample_time_s"] / runs[0][how]["sample_time_s"]
    roots = np.array([complex(*root) for run in runs for root in run[how][which]], dtype=np.complex128)
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(roots**k)


def _responses(runs: list[Evidence]) -> html.Figure:
    """Draw every off-line model, over the estimate without a model of the first run, and the coherence below."""
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.7, 0.3])
    for number, run in enumerate(runs):
        look = {"color": series_colour(number), "width": 1.4}
        line = {"mode": "lines", "line": look, "name": run["run"], "legendgroup": run["run"]}
        figure.add_trace(go.Scatter(x=run["frequency_hz"], y=run["magnitude"], **line), row=1, col=1)
        if run["spectral"] is not None:
            x, y = run["spectral"]["frequency_hz"], run["spectral"]["coherence"]
            figure.add_trace(go.Scatter(x=x, y=y, showlegend=False, **line), row=2, col=1)
    if runs[0]["spectral"] is not None:
        x, y = runs[0]["spectral"]["frequency_hz"], runs[0]["spectral"]["magnitude"]
        dots = {"mode": "markers", "marker": {"color": GREY, "size": 5, "symbol": "circle-open"}}
        figure.add_trace(go.Scatter(x=x, y=y, name=f"without a model, {runs[0]['run']}", **dots), row=1, col=1)
    figure.update_xaxes(**DECADES)
    figure.update_xaxes(title_text="frequency [Hz]", row=2, col=1)
    figure.update_yaxes(title_text="rad/s per Nm", **DECADES, row=1, col=1)
    figure.update_yaxes(title_text="coherence", range=[0.0, 1.05], row=2, col=1)
    return figure_block(figure, "identification-responses", 2 * PANEL_PX + LEGEND_PX)


def _resonances(runs: list[Evidence]) -> html.Figure:
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.08)
    names = [run["run"] for run in runs]
    looks = (("best off line", "best", BLUE, "circle"), ("on line", "online", VERMILION, "diamond-open"))
    for name, how, colour, symbol in looks:
        for row in (1, 2):
            values = [None if run[how]["resonance"] is None else run[how]["resonance"][row - 1] for run in runs]
            dots = {"mode": "markers", "marker": {"color": colour, "size": 10, "symbol": symbol}}
            figure.add_trace(
                go.Scatter(x=names, y=values, name=name, legendgroup=name, showlegend=row == 1, **dots), row=row, col=1
            )
    figure.update_xaxes(type="category")
    figure.update_yaxes(title_text="resonance [Hz]", row=1, col=1)
    figure.update_yaxes(title_text="damping", row=2, col=1)
    return figure_block(figure, "identification-resonances", 2 * PANEL_PX + LEGEND_PX)


def _validation(evidence: Evidence) -> list[Any]:
    worst = dict(evidence["worst"])
    worst["error"] = _array(worst["measured_rad_s"]) - _array(worst["simulated_rad_s"])
    speed = (
        "speed [rad/s]",
        [("measured", "measured_rad_s", Style.MEASURED), ("simulated", "simulated_rad_s", Style.AFTER)],
    )
    error = ("error [rad/s]", [("error", "error", Style.BEFORE)])
    title = html.Heading(f"Worst of the unseen runs: {worst['name']}")
    return [title, *_course("validation-course", worst, speed, error)]


def _diagnosis(evidence: Evidence) -> list[Any]:
    report = html.Link(evidence["report"], evidence["report"])
    model = html.Code(evidence["model_file"])
    return [html.paragraph("Evidence, rivals and pictures: ", report, ". Model file: ", model, ".")]


def _solve(evidence: Evidence) -> list[Any]:
    report = html.Link("solve/report.html", "solve/report.html")
    return [html.paragraph("Evidence, rivals and pictures: ", report, ".")] if evidence["odds"] else []


_FIGURES: Mapping[str, Callable[[Evidence], list[Any]]] = {
    "noise": _noise,
    "signs": _signs,
    "friction": _friction,
    "identification": _identification,
    "validation": _validation,
    "diagnosis": _diagnosis,
    "solve": _solve,
}
