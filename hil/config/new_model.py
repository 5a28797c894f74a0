"""A new model file: structure, values, tolerances, from a person, options or an identification; its text explained."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from estimator.physics.model import STRICTLY_POSITIVE, DrivelineModel, Motion, Parameter, Structure, parameter_unit
from hil.config.model_tables import SCHEMA, ModelDocument, trusted_entry
from hil.config.table import FileKind, schema_line
from hil.errors import ModelFileError, UsageError
from hil.printable import printable
from hil.problems import validate

TOLERANCE: Final = 0.2
"""Of a value from a data sheet, where nothing else is said."""

LEAST_TOLERANCE: Final = 0.05
"""Share of a value from an identification to which it is trusted at best: no interval is that short over the days."""

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

DIGITS = 6
"""Of an interval's ends."""

COMMENTS_AT = 48
"""Column in which comments begin."""


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a parameter before anybody is asked, and from where."""

    parameter: Parameter  # value, and tolerance or interval
    source: str  # in words, for the comment in the new file


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
        measured = known[name].parameter if name in known else None
        value = values.get(name, None if measured is None else measured.value)
        what = f"{MEANINGS[name]}, {name} [{parameter_unit(name, motion)}]"
        if ask is not None and name not in values:
            value = _asked(what, value, ask, name in STRICTLY_POSITIVE)
        if measured is not None and value == measured.value and name not in tolerances:
            found[name] = measured
            continue
        tolerance = tolerances.get(name, usual_tolerance)
        if ask is not None and name not in values:
            tolerance = _asked(f"its relative tolerance, {name}", tolerance, ask, False) if value else 0.0
        if value is None:
            missing.append(f"--value {name}=NUMBER | expected {MEANINGS[name]} | got nothing")
        elif value == 0.0 < tolerance:
            missing.append(
                f"--value {name}=0 | expected --tolerance {name}=0 next to it where there is none, or a value | got "
                f"{100.0 * tolerance:g} % of 0, which is 0: in the file, ci95 = [0.0, 0.5] says where it may lie"
            )
        else:
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
        "# Each value with what it is trusted to, a relative tolerance or the 95 % interval of its measurement: what",
        "# re-tuning within it explains is no missing physics. tolerance = 0: known exactly.",
        "[parameters]",
    ]
    for name, parameter in model.parameters.items():
        by = known[name].source if name in known and known[name].parameter.value == parameter.value else ""
        comment = f"{MEANINGS[name]}, {parameter_unit(name, model.motion)}{f'; {printable(by)}' if by else ''}"
        entry = trusted_entry(parameter)
        if "ci95" in entry:
            entry["ci95"] = [float(f"{end:.{DIGITS}g}") for end in entry["ci95"]]
        text = ", ".join(f"{key} = {value!r}" for key, value in entry.items())
        lines.append(_line(f"{name} = {{ {text} }}", comment))
    if signals:
        lines += ["", f"# What is what in a recording, as hil look found it in {source}: check it.", *signals]
    text = "\n".join([*lines, ""])
    validate(ModelDocument, tomllib.loads(text), file, ModelFileError)
    return text


def _line(code: str, comment: str) -> str:
    return f"{code:<{COMMENTS_AT - 1}} # {comment}"
