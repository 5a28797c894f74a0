"""The scoreboard's part on real recordings: what was concealed and found, and what agrees with the truth withheld."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from hil.report import page as html

Json = Mapping[str, Any]

AGREEMENTS = ("besides what is known", "found", "known", "95 % interval", "asked")
HEADINGS = ("recording", "found", "held-out error before", "after", "black boxes", "report")


def real_section(cases: Sequence[Json], folder: str) -> html.Section:
    """Return the section.

    Parameters
    ----------
    cases
        Of ``real.json``.
    folder
        Where that file is, seen from the page.
    """
    pieces: list[Any] = [
        html.paragraph(
            "Recordings of real machines. What is concealed was taken out of the files, or left out of the nominal "
            "model, before the tool read them; the truth withheld was read after its verdict."
        )
    ]
    for case in cases:
        pieces += [html.Heading(case["title"]), html.paragraph(f"Concealed: {case['conceals']}")]
        rows = [_run(run, case, folder) for run in case["runs"]]
        pieces.append(html.table(HEADINGS, rows, numbers=(2, 3)))
        agreements = [*case["agreements"], *(each for run in case["runs"] for each in run["agreements"])]
        if agreements:
            pieces.append(html.table(AGREEMENTS, map(_agreement, agreements), (1, 2)))
    return html.section("Real recordings", *pieces)


def _run(run: Json, case: Json, folder: str) -> list[Any]:
    found = run["fault"] or ", ".join(run["named"]) or str(run["verdict"]).replace("_", " ")
    mark = "✓" if run["fault"] is None and set(run["named"]) == set(case["concealed"]) else "✗"
    report = html.Link("report", f"{folder}/{run['report']}") if run["report"] else ""
    boxes = "; ".join(f"{box['name']}: {_box(box)}" for box in run["black_boxes"])
    return [
        run["name"],
        f"{mark} {found}",
        _median(run["held_out"]["before"]),
        _median(run["held_out"]["after"]),
        boxes,
        report,
    ]


def _box(box: Json) -> str:
    return _median(box["held_out"]) if box["held_out"] else str(box["reason"])


def _median(by_recording: Mapping[str, float | None]) -> str:
    known = [value for value in by_recording.values() if value is not None]
    return f"{median(known):.3g}" if known else "–"


def _agreement(entry: Json) -> tuple[str, str, str, str, str]:
    unit = entry["unit"]
    found, truth = (f"{_number(entry[key])} {unit}".strip() for key in ("found", "truth"))
    inside = {True: "holds it", False: "misses it", None: ""}[entry["inside"]]
    return entry["what"], found, truth, inside, f"{'✓' if entry['within'] else '✗'} {entry['asked']}"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
