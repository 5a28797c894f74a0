"""``commissioning.html``: a commissioning as one self-contained page, as far as it is.

From the top: what it came to, in figures; all steps at a glance; each step with its findings (expected, measured,
within?), its pictures and its runs; what was decided on the way; the rig file. Made from the state file alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from hil.provenance import Provenance
from hil.report import page as html
from hil.report.commission_step import STATUSES, STYLE, badge, card_row, card_table, step_section
from hil.report.made import made_section
from hil.report.numbers import moment, shown

State = Mapping[str, Any]

MOST_NAMED = 4
"""Findings outside their limits that the head of the page names."""


def commission_page(state: State, titles: Mapping[str, str], made: Provenance | None = None) -> str:
    """Return the text of the page.

    Parameters
    ----------
    state
        Content of the state file (schema ``hil.commission/1``).
    titles
        Title of each step, by name, in order.
    """
    steps = state["steps"]
    sections = [
        step_section(name, titles[name], steps[name], _link(steps[name]) if name == "diagnosis" else "")
        for name in titles
        if steps[name]["status"] != "pending"
    ]
    body = [STYLE, _top(state), _overview(steps, titles), *sections, _decisions(state), _rig(state), made_section(made)]
    return html.page(
        f"Commissioning of {state['rig_name']}",
        (piece for piece in body if piece),
        f"hil commission {state['hil_version']}, begun {moment(state['started_utc'])}, as of "
        f"{moment(state['updated_utc'])}. "
        "Intervals are of 95 % confidence; predicted values are from the driveline as it was known before each run.",
    )


def _top(state: State) -> str:
    records = state["steps"].values()
    outside = sum(finding["within"] is False for record in records for finding in record["findings"])
    to_do = [name for name, record in state["steps"].items() if record["status"] not in ("done", "skipped")]
    if to_do:
        kind, words = "unexplained", f"not complete: {len(to_do)} to do, next is {to_do[0]}"
    elif outside:
        kind, words = "explained", f"complete, {outside} outside their limits"
    else:
        kind, words = "no_mismatch", "complete, all within limits"
    return (
        f'<header class="top {kind}">\n<span class="badge {kind}">{escape(words)}</span>\n'
        f"<h1>Commissioning of {escape(state['rig_name'])}</h1>\n"
        + "".join(html.paragraph(text, "statement") for text in _statements(state))
        + html.tiles(_tiles(state))
        + "\n</header>"
    )


def _statements(state: State) -> Iterator[str]:
    diagnosis = state["steps"]["diagnosis"]["evidence"]
    if diagnosis:
        yield diagnosis["statement"]
    outside = [
        f"{finding['what']}: {finding['measured']}"
        for name, record in state["steps"].items()
        for finding in record["findings"]
        if finding["within"] is False and name != "diagnosis"
    ]
    if outside:
        more = f"; and {len(outside) - MOST_NAMED} more" if len(outside) > MOST_NAMED else ""
        yield f"Outside their limits: {'; '.join(outside[:MOST_NAMED])}{more}."


def _tiles(state: State) -> Iterator[tuple[str, str, str]]:
    evidence = {name: record["evidence"] for name, record in state["steps"].items()}
    resonances = [run["best"]["resonance"] for run in evidence["identification"].get("runs", [])]
    known = [resonance for resonance in resonances if resonance is not None]
    if known:
        frequency, damping = (sum(values) / len(known) for values in zip(*known, strict=True))
        yield "resonance", shown(frequency, "Hz"), f"mean of {len(known)} runs"
        yield "damping", f"{damping:.3f}", f"mean of {len(known)} runs"
    if "amplitude_nm" in evidence["prbs"]:
        yield "PRBS", f"±{evidence['prbs']['amplitude_nm']:g} Nm", str(evidence["prbs"]["reason"])
    if evidence["scales"].get("gain") and None not in evidence["scales"]["gain"]:
        gain, spread = evidence["scales"]["gain"]
        yield "m2 against m1", f"{100.0 * (gain - 1.0):+.1f} %", f"±{100.0 * spread:.1f} %, for the same reading"
    if "inertia_kg_m2" in evidence["friction"]:
        inertia, spread = evidence["friction"]["inertia_kg_m2"]
        yield "inertia", shown(inertia, "kg m²"), "" if spread is None else f"±{shown(spread)}, at the motor shaft"
    driven_s = sum(run["seconds"] for record in state["steps"].values() for run in record["runs"])
    yield "driven", f"{driven_s / 60.0:.1f} min", "of this and earlier calls, without attempts that were repeated"


def _overview(steps: Mapping[str, Any], titles: Mapping[str, str]) -> str:
    columns = ("step", "status", "findings", "because")
    rows = []
    for number, (name, title) in enumerate(titles.items(), start=1):
        record = steps[name]
        within = sum(finding["within"] is True for finding in record["findings"])
        outside = sum(finding["within"] is False for finding in record["findings"])
        counted = f"{within} within" + (f", {outside} outside" if outside else "") if record["findings"] else "–"
        cells = (
            f"{number} {escape(title)}",
            badge(*STATUSES[record["status"]]),
            escape(counted),
            escape(record["because"] or "–"),
        )
        rows.append(card_row(columns, cells, outside > 0))
    return html.section("Steps", card_table(columns, rows))


def _link(record: Mapping[str, Any]) -> str:
    evidence = record["evidence"]
    if not evidence:
        return ""
    return (
        f'<p>Evidence, rivals and pictures: <a href="{escape(evidence["report"])}">{escape(evidence["report"])}</a>. '
        f"Model file: <code>{escape(evidence['model_file'])}</code>.</p>"
    )


def _decisions(state: State) -> str:
    if not state["notes"]:
        return ""
    rows = [(moment(note["at_utc"]), note["what"], note["changes"], note["steps"]) for note in state["notes"]]
    return html.section("Decisions on the way", html.table(("at", "what", "changes", "steps done before"), rows))


def _rig(state: State) -> str:
    text = f"<pre>{escape(state['rig_text'])}</pre>"
    return html.section("The rig file", html.paragraph(state["rig_path"], "note"), html.details("show it", text))
