"""``fleet.html``: which vehicles have what since when, each against its own fleet, and the way to every verdict.

A fleet is what was computed with the same model. Of a recording that was computed more than once, by another version or
with another model, the last result counts.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hil.fleet.dataset import VERDICTS, DatasetRow, read
from hil.fleet.pooling import (
    FALSE_RATE,
    FEWEST_VEHICLES,
    QUANTILE,
    Change,
    Pooled,
    Seen,
    Usual,
    change,
    pooled,
    usual,
)
from hil.fleet.sources import in_order
from hil.provenance import Provenance
from hil.report import page as html
from hil.report.made import made_section
from hil.report.numbers import moment, shown

FILE_NAME = "fleet.html"

FOLLOWED = {
    ("", "frequency_hz"): "resonance",
    ("", "damping"): "damping",
    ("", "k"): "stiffness",
    ("", "b_M"): "friction at the motor",
    ("", "b_L"): "friction at the load",
    ("backlash", "gap_rad"): "gap",
    ("coulomb_friction_motor", "friction_nm"): "dry friction at the motor",
    ("coulomb_friction_load", "friction_nm"): "dry friction at the load",
}
"""What is followed over a vehicle's recordings, and what it is called."""

Of = tuple[str, str]
"""Effect, or empty, and parameter."""

Vehicle = tuple[str, str]
"""Vehicle and rig."""

Courses = Mapping[Vehicle, Sequence["Course"]]


@dataclass(frozen=True, slots=True)
class Course:
    """One parameter of one vehicle over its recordings; ``pooled`` where its fleet is large enough."""

    of: Of  # effect (empty for the line) and parameter
    unit: str  # empty for a pure number
    seen: Seen  # of this vehicle
    dates: tuple[str, ...]  # day of each recording, its name where none is known
    usual: Usual  # of all vehicles with that model
    pooled: Pooled | None
    change: Change | None  # the largest step over its recordings; None where none is beyond chance


def _current(folder: Path) -> dict[str, DatasetRow]:
    """Return the recordings' rows by their keys, of several results that share a content the last."""
    known: set[tuple[str, bool, str]] = set()
    last: list[DatasetRow] = []
    for row in reversed(read(folder, "recordings")):
        contents = {(row["command"], row["n_recordings"] > 1, sha256) for sha256 in row["sha256"].split()}
        if not contents & known:
            last.append(row)
        known |= contents
    return {row["key"]: row for row in sorted(last, key=lambda row: (row["started"], row["url"]))}


def _values(folder: Path, rows: Mapping[str, DatasetRow]) -> dict[tuple[str, Of], dict[Vehicle, list[DatasetRow]]]:
    """Return what was estimated, by model and parameter, then by vehicle in the order of time."""
    order = {key: place for place, key in enumerate(rows)}
    found: dict[tuple[str, Of], dict[Vehicle, list[DatasetRow]]] = defaultdict(lambda: defaultdict(list))

    def take(key: str, effect: str, of: DatasetRow) -> None:
        row = rows[key]
        found[row["model_sha256"], (effect, of["parameter"])][row["vehicle"], row["rig"]].append({**of, "of": row})

    for each in read(folder, "parameters"):
        if each["key"] in rows and each["value"] is not None and _is_known(each):
            take(each["key"], each["effect"], each)
    for key, row in rows.items():
        if row["command"] == "diagnose":
            for name, unit in (("frequency_hz", "Hz"), ("damping", "")):
                if row[name] is not None:
                    line = {"parameter": name, "value": row[name], "low": None, "high": None, "unit": unit, "key": key}
                    take(key, "", line)
    for vehicles in found.values():
        for of_vehicle in vehicles.values():
            of_vehicle.sort(key=lambda each: order[each["of"]["key"]])
    return found


def _is_known(row: DatasetRow) -> bool:
    """Whether an interval is shorter than its value: with wider ones nothing is followed."""
    return row["low"] is not None and row["high"] is not None and row["high"] - row["low"] < 2.0 * abs(row["value"])


def _seen(rows: Sequence[DatasetRow]) -> Seen:
    std = [0.0 if each["low"] is None else (each["high"] - each["low"]) / (2.0 * QUANTILE) for each in rows]
    return Seen(np.array([each["value"] for each in rows]), np.array(std))


def usual_parameters(folder: Path) -> dict[str, Usual]:
    """Return what is usual of the line's own parameters, over all vehicles of a dataset."""
    vehicles: dict[str, dict[Vehicle, list[DatasetRow]]] = defaultdict(lambda: defaultdict(list))
    for (_, (effect, name)), of_vehicles in _values(folder, _current(folder)).items():
        for vehicle, rows in of_vehicles.items():
            vehicles[name][vehicle] += [] if effect else rows
    known = {name: [_seen(rows) for rows in each.values() if rows] for name, each in vehicles.items()}
    return {name: usual(seen) for name, seen in known.items() if len(seen) > 1}


def courses_of(folder: Path, rows: Mapping[str, DatasetRow]) -> dict[Vehicle, list[Course]]:
    """Follow what is followed of every vehicle."""
    found: dict[Vehicle, list[Course]] = defaultdict(list)
    for (_, of), vehicles in _values(folder, rows).items():
        if of not in FOLLOWED:
            continue
        seen = {vehicle: _seen(each) for vehicle, each in vehicles.items()}
        known = usual(list(seen.values()))
        for vehicle, each in seen.items():
            found[vehicle].append(
                Course(
                    of,
                    vehicles[vehicle][0]["unit"],
                    each,
                    tuple(_day(row["of"]["started"]) or row["of"]["name"] for row in vehicles[vehicle]),
                    known,
                    pooled(each, known) if known.n_vehicles >= FEWEST_VEHICLES else None,
                    change(each, known.within),
                )
            )
    order = list(FOLLOWED)
    return {vehicle: sorted(each, key=lambda course: order.index(course.of)) for vehicle, each in found.items()}


def fleet_page(folder: Path, made: Provenance) -> str:
    """Return the page of a dataset."""
    rows = _current(folder)
    effects = [each for each in read(folder, "effects") if each["key"] in rows]
    failures = read(folder, "failures")
    courses = courses_of(folder, rows)
    vehicles = sorted(
        {(row["vehicle"], row["rig"]) for row in rows.values()}, key=lambda each: [in_order(name) for name in each]
    )
    outliers = [each for each in vehicles if any(_is_outlier(course) for course in courses.get(each, ()))]
    changed = [each for each in vehicles if any(course.change for course in courses.get(each, ()))]
    having = {(each["vehicle"], each["rig"]) for each in effects}
    title = f"{len(vehicles)} vehicles: {len(having)} with an effect, {len(outliers)} unlike the others"
    tiles = [
        ("vehicles", str(len(vehicles)), ""),
        ("recordings", str(sum(row["n_recordings"] for row in rows.values())), ""),
        ("with an effect", str(len(having)), "vehicles"),
        ("unlike the others", str(len(outliers)), f"vehicles; {FALSE_RATE:.1%} of sound ones, of each value"),
        ("changed", str(len(changed)), "vehicles"),
        ("not computed", str(len(failures)), "of the last run"),
    ]
    blocks = [
        html.header(title, html.tiles(tiles), badge="fleet", facts=[("date", moment(made.date))]),
        html.section("Vehicles", _vehicles(vehicles, rows, effects, courses)),
        html.section("One vehicle", _courses(courses)),
        html.section("Effects", _effects(effects, rows)) if effects else None,
        html.section("What is usual in the fleet", _usual(courses), _priors(rows)),
        html.section("Recordings", _recordings(rows, effects)),
        html.section("Not computed", _failures(failures)) if failures else None,
        made_section(made),
    ]
    return html.page(f"fleet: {title}", blocks, made.program)


def _day(started: str) -> str:
    """Write a moment in ISO 8601 in the room a table has."""
    return started[:16].replace("T", " ")


def _is_outlier(course: Course) -> bool:
    return course.pooled is not None and course.pooled.is_outlier


def _name(vehicle: Vehicle) -> str:
    return vehicle[0] if vehicle[1] in ("", vehicle[0]) else f"{vehicle[0]} ({vehicle[1]})"


def _vehicles(
    vehicles: Sequence[Vehicle],
    rows: Mapping[str, DatasetRow],
    effects: Sequence[DatasetRow],
    courses: Courses,
) -> html.Register:
    of_vehicle: dict[Vehicle, list[DatasetRow]] = defaultdict(list)
    for row in rows.values():
        of_vehicle[row["vehicle"], row["rig"]].append(row)
    named = {(each["vehicle"], each["rig"], effect): text for each, effect, text in _since(effects, rows)}
    found: dict[Vehicle, list[str]] = defaultdict(list)
    for (vehicle, rig, effect), text in named.items():
        found[vehicle, rig].append(f"{effect} {text}")
    lines = []
    for each in vehicles:
        own, followed = of_vehicle[each], courses.get(each, [])
        away = [f"{FOLLOWED[c.of]} {c.pooled.away:+.1f} σ" for c in followed if c.pooled and c.pooled.is_outlier]
        steps = [
            f"{FOLLOWED[c.of]} {shown(c.change.before)} → {shown(c.change.after, c.unit)} at {c.dates[c.change.first]}"
            for c in followed
            if c.change
        ]
        count = sum(row["n_recordings"] for row in own)
        dates = _day(own[0]["started"]), _day(own[-1]["started"])
        lines.append([_name(each), count, *dates, "; ".join(found[each]), "; ".join(away), "; ".join(steps)])
    headings = ("vehicle", "recordings", "first", "last", "effects", "unlike the others", "changes")
    return html.Register("vehicles", headings, lines, choose=True)


def _since(effects: Sequence[DatasetRow], rows: Mapping[str, DatasetRow]) -> Iterator[tuple[DatasetRow, str, str]]:
    """Yield of each vehicle and effect: its first row, the effect, and since when it is there and how often."""
    order = {key: place for place, key in enumerate(rows)}
    grouped: dict[tuple[str, str, str], list[DatasetRow]] = defaultdict(list)
    for each in sorted(effects, key=lambda each: order[each["key"]]):
        grouped[each["vehicle"], each["rig"], each["effect"]].append(each)
    for (_, _, effect), found in grouped.items():
        since = f"since {_day(found[0]['started'])} " if found[0]["started"] else ""
        yield found[0], effect, f"{since}({len(found)} times)"


def _effects(effects: Sequence[DatasetRow], rows: Mapping[str, DatasetRow]) -> html.Register:
    order = {key: place for place, key in enumerate(rows)}
    names = ("effect", "element", "started", "probability", "share", "indistinguishable_from", "key")
    lines = [
        [_name((each["vehicle"], each["rig"])), *(_cell(each, name) for name in names)]
        for each in sorted(effects, key=lambda each: order[each["key"]])
    ]
    headings = ("vehicle", "effect", "element", "recorded", "probability", "share", "or else", "verdict")
    return html.Register("effects", headings, lines, VERDICTS)


def _cell(row: DatasetRow, name: str) -> Any:
    return _day(row[name]) if name == "started" else row[name]


def _recordings(rows: Mapping[str, DatasetRow], effects: Sequence[DatasetRow]) -> html.Register:
    names = ("name", "started", "command", "verdict", "effects", "frequency_hz", "damping", "statement", "key")
    lines = [[_name((row["vehicle"], row["rig"])), *(_cell(row, name) for name in names)] for row in rows.values()]
    headings = (
        "vehicle", "recording", "recorded", "by", "verdict", "effects", "resonance [Hz]", "damping", "statement",
        "verdict's file",
    )  # fmt: skip
    return html.Register("recordings", headings, lines, VERDICTS)


def _failures(failures: Sequence[DatasetRow]) -> html.Register:
    lines = [[each["vehicle"], each["url"], each["command"], each["error"]] for each in failures]
    return html.Register("not computed", ("vehicle", "recording", "by", "why"), lines)


def _usual(courses: Courses) -> list[Any]:
    known = {(course.of, course.unit): course.usual for of in courses.values() for course in of}
    lines = [
        (FOLLOWED[of], shown(each.mean, unit), shown(each.between), shown(each.within), each.n_vehicles)
        for (of, unit), each in sorted(known.items(), key=lambda item: list(FOLLOWED).index(item[0][0]))
    ]
    text = (
        "Mean, standard deviation from vehicle to vehicle and from drive to drive, of the vehicles that are like the "
        f"others. With fewer than {FEWEST_VEHICLES} of them nobody is compared. The share of a vehicle's value that "
        "comes from the fleet stands at its course."
    )
    headings = ("", "mean", "from vehicle to vehicle", "from drive to drive", "vehicles")
    return [html.note(text), html.table(headings, lines, numbers=(1, 2, 3, 4))] if lines else []


def _priors(rows: Mapping[str, DatasetRow]) -> html.Paragraph | None:
    with_prior = [row for row in rows.values() if row["from_fleet"]]
    if not with_prior:
        return None
    names = ", ".join(sorted({name for row in with_prior for name in row["from_fleet"].split()}))
    return html.paragraph(f"In {len(with_prior)} results the nominal values of {names} are the fleet's (--prior).")


def _courses(courses: Courses) -> html.Courses:
    hint = "Choose a vehicle above: its values over its recordings, grey what is usual in the fleet (95 %)."
    return html.Courses(hint, {_name(vehicle): [_drawn(each) for each in of] for vehicle, of in courses.items()})


def _drawn(course: Course) -> dict[str, Any]:
    seen, known, found, step = course.seen, course.usual, course.pooled, course.change
    name, n = FOLLOWED[course.of], seen.value.size
    half = QUANTILE * float(np.hypot(known.between, known.within))
    said = f"{name}: {shown(seen.value[-1], course.unit)} last"
    if found is not None:
        said = (
            f"{name}: {shown(found.value)} ± {shown(QUANTILE * found.std, course.unit)} over all, "
            f"{found.from_fleet:.0%} of it from the fleet; {found.away:+.1f} σ from the others"
        )
    if step is not None:
        said += f"; changed at {course.dates[step.first]}"
    levels = [] if step is None else [[0, step.first, step.before], [step.first, n, step.after]]
    bounds = [None if s == 0.0 else QUANTILE * s for s in seen.std.tolist()]
    return {
        "said": said,
        "unit": course.unit,
        "value": _short(seen.value.tolist()),
        "low": _short([None if b is None else v - b for v, b in zip(seen.value.tolist(), bounds, strict=True)]),
        "high": _short([None if b is None else v + b for v, b in zip(seen.value.tolist(), bounds, strict=True)]),
        "usual": [] if found is None else [known.mean - half, known.mean + half],
        "levels": levels,
        "dates": [course.dates[0], course.dates[-1]],
    }


def _short(values: Sequence[float | None]) -> list[float | None]:
    return [None if each is None else float(f"{each:.6g}") for each in values]
