"""A new model file: structure, values, tolerances, from a person, options or an identification; its text explained."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from estimator.physics.model import STRICTLY_POSITIVE, DrivelineModel, Motion, Parameter, Structure, parameter_unit
from hil.config.model_tables import SCHEMA, ModelDocument
from hil.config.table import FileKind, schema_line
from hil.errors import ModelFileError, UsageError
from hil.printable import printable
from hil.problems import validate

TOLERANCE: Final = 0.2
"""Of a value from a data sheet, where nothing else is said."""

LEAST_TOLERANCE, MOST_TOLERANCE = 0.05, 0.95
"""Of a value from an identification: no interval is that short over the days, nor worth more than that."""

MEANINGS: Final[Mapping[str, str]] = {
    "J_M": "inertia of the motor",
    "J_2": "inertia between the two shafts",
    "J_L": "inertia of the load, at the motor shaft",
    "k": "stiffness of the shaft",
    "c": "damping of the shaft",
    "k_2": "stiffness of the second shaft",
    "c_2": "damping of the second shaft",
    "b_M": "viscous friction at the motor",
    "b_L": "viscous friction at the load",
}

Ask = Callable[[str, str, str], str]
"""Asks a person: what for, the default (empty: none), what was wrong with the answer before (empty: nothing)."""


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a parameter before anybody is asked, and from where."""

    value: float
    tolerance: float
    source: str


def assignments(option: str, texts: Sequence[str], structure: Structure) -> dict[str, float]:
    """Read NAME=NUMBER as often as it was given."""
    found: dict[str, float] = {}
    faults = []
    for text in texts:
        name, _, number = text.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if name not in structure.parameter_names or not math.isfinite(value):
            names = ", ".join(structure.parameter_names)
            faults.append(f"{option} {text} | expected NAME=NUMBER with a name of {structure.value} ({names})")
        found[name] = value
    if faults:
        raise UsageError("\n".join(faults))
    return found


def parameters(
    structure: Structure,
    motion: Motion,
    values: Mapping[str, float],
    tolerances: Mapping[str, float],
    usual_tolerance: float,
    known: Mapping[str, Known],
    ask: Ask | None,
) -> dict[str, Parameter]:
    """Return every parameter of a structure."""
    found: dict[str, Parameter] = {}
    missing = []
    for name in structure.parameter_names:
        value = values.get(name, known[name].value if name in known else None)
        tolerance = tolerances.get(name, known[name].tolerance if name in known else usual_tolerance)
        if ask is not None and name not in values:
            what = f"{MEANINGS[name]}, {name} [{parameter_unit(name, motion)}]"
            value = _asked(what, value, ask, name in STRICTLY_POSITIVE)
            tolerance = _asked(f"its relative tolerance, {name}", tolerance, ask, False)
        if value is None:
            missing.append(f"--value {name}=NUMBER | expected {MEANINGS[name]} | got nothing")
            continue
        found[name] = Parameter(value, tolerance)
    if missing:
        raise UsageError("\n".join(missing))
    return found


def _asked(what: str, default: float | None, ask: Ask, positive: bool) -> float:
    wrong = ""
    while True:
        text = ask(what, "" if default is None else f"{default:.6g}", wrong).strip()
        if not text and default is not None:
            return default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if math.isfinite(value) and (value > 0.0 if positive else value >= 0.0):
            return value
        wrong = f"expected a number {'above 0' if positive else 'of 0 or more'}, got {text!r}"


COMMENTS_AT = 48
"""Column in which comments begin."""


def model_text(
    file: Path, model: DrivelineModel, known: Mapping[str, Known], signals: Sequence[str], recording: Path | None
) -> str:
    """Return the file, checked as any model file is."""
    where = "at the motor shaft" if model.motion is Motion.ROTATION else "in the line of travel"
    source = "REC" if recording is None else printable(recording.name)
    lines = [
        schema_line(FileKind.MODEL),
        f"# A model of a driveline. All values are SI, {where}.",
        f"#   hil diagnose {source} --model {printable(file.name)} --out report",
        "",
        f'schema = "{SCHEMA}"',
        _line(f'structure = "{model.structure.value}"', "one_mass, two_mass, three_mass or joint"),
        _line(f'motion = "{model.motion.value}"', "rotation, or translation: kg, N, m"),
        "",
        "# Each value with the relative tolerance that it is trusted to: what re-tuning within it explains is no",
        "# missing physics. 0: known exactly.",
        "[parameters]",
    ]
    for name, parameter in model.parameters.items():
        by = known[name].source if name in known and known[name].value == parameter.value else ""
        comment = f"{MEANINGS[name]}, {parameter_unit(name, model.motion)}{f'; {printable(by)}' if by else ''}"
        entry = f"{name} = {{ value = {parameter.value!r}, tolerance = {parameter.tolerance!r} }}"
        lines.append(_line(entry, comment))
    if signals:
        lines += ["", f"# What is what in a recording, as hil look found it in {source}: check it.", *signals]
    text = "\n".join([*lines, ""])
    validate(ModelDocument, tomllib.loads(text), file, ModelFileError)
    return text


def _line(code: str, comment: str) -> str:
    return f"{code:<{COMMENTS_AT - 1}} # {comment}"
