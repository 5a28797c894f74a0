"""What a design says: to a person, to a script, to ``hil run``, and as a picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from estimator.design.open import Candidate, Open, name_of
from estimator.design.paper import Width
from estimator.physics.catalogue import title_of
from estimator.physics.tables import PLACES
from hil.design.design import WORTH, Aim, Design, Planned, wide
from hil.figures.drawn import drawing, require_matplotlib

SCHEMA = "hil.design/1"

MOST_SHOWN = 1e6
"""Factor of odds from which no more digits are said."""

LISTED = 3
"""Other experiments that are named."""


def in_words(candidate: str) -> str:
    """Return a set of effects, by its name in files, as a sentence has it."""
    return " and ".join(map(title_of, candidate.split(" + ")))


def question_lines(known: Open) -> Iterator[str]:
    """Say what recordings leave open."""
    first, *rivals = known.candidates
    if known.named is None:
        yield f"No explanation leaves only noise; the best so far: {in_words(first.name)}."
        if known.unnamed is not None:
            over = PLACES[known.unnamed.place].over
            yield f"A law without a name is left, a torque over {over}: an experiment can make its curve known better."
    elif not rivals:
        yield f"One explanation is left: {in_words(first.name)}."
    if rivals:
        yield "The recordings leave open, with the odds of each among these:"
        yield from (f"  {each.name:40} {each.probability:.3f}" for each in known.candidates)
    for each in known.against if known.named is not None else ():
        yield (
            f"  The verdict names {in_words(name_of(known.named or frozenset()))}; with odds of "
            f"{each.probability:.3f} it is {as_rival(each)}: not decided."
        )
    if known.untested:
        yield f"  Neither found nor excluded so far: {', '.join(map(title_of, known.untested))}."
    yield from (f"  {condition}." for condition in conditions(known))
    for name, twins in known.twins.items():
        yield (
            f"  {title_of(name)} and {' and '.join(map(title_of, twins))} are the same linear system by this output: "
            "no experiment distinguishes them. Measure another output, such as the load's speed."
        )


def conditions(known: Open) -> Iterator[str]:
    """Say what the values reported take for granted: that what was not tested is not there."""
    for name, each in known.supposed.items():
        if each.moves:
            size = ", ".join(f"{parameter} = {value:.3g}" for parameter, value in each.size.items())
            moved = _moved(each.moves, f": {size} would move ")
            yield f"as if without {title_of(name)}, which the recordings do not show{moved}"


def as_rival(candidate: Candidate) -> str:
    """Return what another explanation is, and by how much it would move the values that are reported."""
    return in_words(candidate.name) + _moved(candidate.moves, ", which would move ")


def _moved(moves: Mapping[str, float], said: str) -> str:
    """Say by how much values move, after some words; nothing where none does."""
    return said + ", ".join(f"{value} by {100.0 * share:+.2g} %" for value, share in moves.items()) if moves else ""


def design_lines(known: Open, design: Design) -> Iterator[str]:
    """Say what is to be driven and what it is expected to bring."""
    planned = design.planned
    low, high = planned.speed_rad_s
    yield f"Next experiment: {planned.name} ({design.key})"
    yield (
        f"  the vehicle is needed for {planned.seconds:.0f} s; speed {low:.1f} to {high:.1f} rad/s, torque up to "
        f"{planned.largest_nm:.0f} Nm, the shaft turns by up to {planned.angle_rad / (2.0 * math.pi):.0f} turns"
    )
    if design.decides is not None:
        now = sum(each.probability**2 for each in known.candidates)
        yield (
            f"  expected: the odds change by a factor of {_factor(design.factor)}; the true one then has a probability "
            f"of {design.decides.right:.3f} in the mean, now {now:.3f}"
        )
    elif not design.shows:
        yield f"  expected: intervals that are wide become shorter by a factor of {_factor(design.factor)}"
        yield from (f"    {line}" for line in width_lines(design.widths))
    if design.shows:
        yield f"  shows what no recording so far does: {', '.join(map(title_of, design.shows))}"
    if not design.is_worth_driving:
        yield f"  {obstacle(design)}"
    others = ", ".join(f"{name} ({_value(value, design)})" for name, value in design.others[:LISTED])
    if others:
        yield f"  next best: {others}"
    if design.refused:
        name, why = next(iter(design.refused.items()))
        yield f"  {len(design.refused)} others may not be driven here, such as {name}: {why.splitlines()[0]}"


def _value(value: float, design: Design) -> str:
    if design.decides is not None:
        return f"probability {value:.3f}"
    return f"shows {value:.0f}" if design.aim is Aim.DECIDE else f"factor {value:.3g}"


def _factor(factor: float) -> str:
    return f"{factor:.3g}" if factor < MOST_SHOWN else f"more than {MOST_SHOWN:.0e}"


def width_lines(widths: Sequence[Width]) -> Iterator[str]:
    """Say how well each value is known now, and then."""
    for each in widths:
        yield f"{each.name:32} {each.value:.4g} ± {each.now:.2g} {each.unit}, then ± {each.after:.2g}"


def obstacle(design: Design) -> str:
    """Say why no experiment tells enough, and by how much a limit would have to be raised.

    Information grows with the time, and with the square of the torque.
    """
    if design.decides is None and design.aim is Aim.DECIDE:
        return "no experiment that this rig may drive shows one of these"
    if design.aim is Aim.LAW and not wide(design.widths):
        return "the curve is known to a tenth of its largest torque"
    if design.aim is Aim.LAW:
        return "no experiment that this rig may drive makes the curve's intervals clearly shorter"
    if design.aim is Aim.PARAMETERS:
        return "no experiment that this rig may drive makes intervals clearly shorter"
    gained = math.log(max(design.factor, 1.0))
    if gained < 1e-3:
        return "no experiment that this rig may drive distinguishes them: they move the speed alike in all of them"
    longer = math.log(WORTH) / gained
    return (
        f"not worth driving: no experiment within the rig's limits changes the odds by a factor of {WORTH:g}. It would "
        f"take {longer:.2g} times the duration ([design] most_duration_s), or {math.sqrt(longer):.2g} times the torque "
        "([design] most_torque_nm, within the guard's)"
    )


def design_document(known: Open, design: Design | None, aim: Aim) -> dict[str, Any]:
    """Return the design as JSON (schema ``hil.design/1``)."""
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "for": aim.value,
        "hypotheses": [{"effects": sorted(each.effects), "probability": each.probability} for each in known.candidates],
        "same_by_this_output": {name: list(twins) for name, twins in known.twins.items()},
        "untested": list(known.untested),
        "conditions": list(conditions(known)),
        "decided": known.is_decided,
        "law_without_a_name": None if known.unnamed is None else known.unnamed.place,
        "experiment": None,
    }
    if design is None:
        return document
    planned = design.planned
    return document | {
        "worth_driving": design.is_worth_driving,
        "obstacle": None if design.is_worth_driving else obstacle(design),
        "experiment": {"key": design.key, "name": planned.name, "table": dict(planned.table)},
        "expected": {
            "factor": min(design.factor, MOST_SHOWN),
            "probability": None if design.decides is None else design.decides.right,
            "intervals": [asdict(each) for each in design.widths],
        },
        "drive": {
            "seconds": planned.seconds,
            "torque_nm": planned.largest_nm,
            "speed_rad_s": list(planned.speed_rad_s),
            "angle_rad": planned.angle_rad,
        },
        "others": [{"name": name, "value": value} for name, value in design.others],
        "refused": design.refused,
    }


def design_toml(design: Design, rig: Path) -> str:
    """Return the experiment as a table of a rig file."""
    document = tomlkit.document()
    document.add(tomlkit.comment(f"Designed: {design.planned.name}. Drive it by"))
    document.add(tomlkit.comment(f"  hil run {rig} THIS_FILE --out {design.key}.csv"))
    document.add(tomlkit.comment(f"or copy the table into the rig file and name it: hil run {rig} {design.key} …"))
    experiments = tomlkit.table(is_super_table=True)
    table = tomlkit.table()
    for key, value in design.planned.table.items():
        if isinstance(value, dict):
            inline = tomlkit.inline_table()
            inline.update({k: _rounded(v) for k, v in value.items()})
            table.add(key, inline)
        else:
            table.add(key, _rounded(value))
    experiments.add(design.key, table)
    document.add("experiments", experiments)
    return tomlkit.dumps(document)


def _rounded(value: Any) -> Any:
    return float(f"{value:.6g}") if isinstance(value, float) else value


def draw(planned: Planned, path: Path) -> None:
    """Draw torque and speed of an experiment as they are expected."""
    require_matplotlib()
    with drawing():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7.16, 3.4))
        top, bottom = figure.subplots(2, 1, sharex=True)
        record = planned.record
        top.step(record.time_s, record.total_torque_nm, where="post", linewidth=0.6)
        bottom.plot(record.time_s, record.output, linewidth=0.8)
        top.set_ylabel("torque, both inverters [Nm]")
        bottom.set_ylabel("motor speed [rad/s]")
        bottom.set_xlabel("time in the recorded part [s]")
        top.set_title(f"{planned.name}, as predicted")
        bottom.set_xlim(float(record.time_s[0]), float(record.time_s[-1]))
        if float(np.ptp(record.total_torque_nm)) == 0.0:
            top.set_ylim(-1.0, 1.0)
        figure.savefig(path, dpi=150)
