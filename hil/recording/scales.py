"""The scale of a column: as it was given, else of its unit; and readings that wrap, put right where that was said.

A unit is used only where no scale is given. One of another quantity than the column's role is refused, for two columns
are swapped then; so is a share of a rated value, for what that is the file does not say.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import Final

import numpy as np

from hil.errors import RecordingError
from hil.recording.table import FloatArray, Table

TURN: Final = 2.0 * math.pi
FOOT_M, POUND_N = 0.3048, 4.4482216152605

_SUPERSCRIPTS: Final = str.maketrans("\u2070\u00b9\u00b2\u00b3\u207b", "0123-")

_SUFFIXES: Final[Mapping[str, str]] = {
    "rpm": "rpm",
    "1_min": "1/min",
    "rad_s": "rad/s",
    "radps": "rad/s",
    "rad_per_s": "rad/s",
    "deg_s": "deg/s",
    "nm": "Nm",
    "knm": "kNm",
    "deg": "deg",
    "rad": "rad",
    "kmh": "km/h",
    "km_h": "km/h",
    "m_s": "m/s",
    "ms": "ms",
    "us": "us",
    "ns": "ns",
    "pct": "%",
    "percent": "%",
    "permille": "permille",
}
"""What a name may end in behind an underscore or a blank, and the unit that it is."""

_TIME_IN_S: Final = re.compile(r"(t|time|zeit)(_\w+)?_s")

_AFTER_WORD: Final = re.compile(r"(?:\sin|\s*[/;])\s+(\S+(?:\s\S+)?)$")
"""``n in 1/min``, and ``n / min⁻¹`` as ISO 80000 has it."""

_IN_BRACKETS: Final = re.compile(r"\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\s*$")
_NAMED_AT_THE_END: Final = re.compile(r"\s*(?:\[[^\[\]]*[\]\)]|\([^()]*\))\s*$")

WITHOUT_MEANING: Final = re.compile(r"(values?|data|signals?|samples?|y)(\(.*\))?|\d+", re.IGNORECASE)
"""Parts of a path that say nothing of what a channel is."""

WRAPS_BITS: Final = (8, 16, 32)  # lengths of the whole numbers that loggers store

STEP_RATIO: Final = 4.0
"""How much larger a step may be where the reading begins anew, put right, than the largest other step."""


class Quantity(Enum):
    """What a unit is of; the value is the word for people."""

    TIME = "time"
    TORQUE = "torque"
    FORCE = "force"
    SPEED = "speed"
    VELOCITY = "velocity"
    ANGLE = "angle"
    LENGTH = "length"
    ACCELERATION = "acceleration"
    SHARE = "share"  # of a rated value that the unit does not say
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class Unit:
    """One unit: a value in it times ``factor`` is in SI."""

    quantity: Quantity  # SHARE and OTHER have no way to SI without a scale
    factor: float


_SPELLED: Final[Mapping[tuple[Quantity, float], str]] = {
    (Quantity.TIME, 1.0): "s sec second seconds",
    (Quantity.TIME, 1e-3): "ms msec millisecond milliseconds",
    (Quantity.TIME, 1e-6): "us µs microsecond microseconds",
    (Quantity.TIME, 1e-9): "ns nanosecond nanoseconds",
    (Quantity.TIME, 60.0): "min",
    (Quantity.TIME, 3600.0): "h hr hour hours",
    (Quantity.TIME, 86_400.0): "d day days",
    (Quantity.TORQUE, 1.0): "nm n*m n-m newtonmeter newtonmetre newton-meter newton*meter newton*meters newton-metre",
    (Quantity.TORQUE, 1e3): "knm kn*m",
    (Quantity.TORQUE, 1e-3): "mnm mn*m",
    (Quantity.TORQUE, 1e-2): "ncm n*cm",
    (Quantity.TORQUE, FOOT_M * POUND_N): "lbft lbf*ft lb*ft ftlb ft*lb ft*lbf lb-ft ft-lb lbf-ft",
    (Quantity.FORCE, 1.0): "n newton",
    (Quantity.FORCE, 1e3): "kn",
    (Quantity.SPEED, 1.0): "rad/s rad/sec 1/s rad*s^-1 radians/s radians/second",
    (Quantity.SPEED, TURN / 60.0): "rpm 1/min r/min rev/min u/min upm min^-1 min-1 turns/min revolutions/minute",
    (Quantity.SPEED, TURN): "rps rev/s r/s u/s turns/s",
    (Quantity.SPEED, math.pi / 180.0): "deg/s deg/sec °/s °/sec",
    (Quantity.VELOCITY, 1.0): "m/s",
    (Quantity.VELOCITY, 1.0 / 3.6): "km/h kmh kph",
    (Quantity.VELOCITY, 0.44704): "mph mi/h",
    (Quantity.VELOCITY, 1e-3): "mm/s",
    (Quantity.ANGLE, 1.0): "rad radian radians",
    (Quantity.ANGLE, math.pi / 180.0): "deg ° degree degrees",
    (Quantity.ANGLE, TURN): "rev turn turns",
    (Quantity.LENGTH, 1.0): "m",
    (Quantity.LENGTH, 1e-3): "mm",
    (Quantity.ACCELERATION, 1.0): "rad/s^2 rad/s2 m/s^2 m/s2",
    (Quantity.SHARE, 1e-2): "% pct percent prozent",
    (Quantity.SHARE, 1e-3): "‰ permille permil promille o/oo 0/00",
    (Quantity.OTHER, 1.0): "- 1 v mv a ma w kw kwh ah ohm °c degc c k hz khz bar pa kpa g kg l bit enum count",
}
_UNITS: Final[Mapping[str, Unit]] = MappingProxyType(
    {spelling: Unit(*meaning) for meaning, spellings in _SPELLED.items() for spelling in spellings.split()}
)


def unit_of(text: str) -> Unit | None:
    """Return what a unit means, however it is spelled; None where it is none that is known here."""
    plain = text.strip().strip("[]()").strip().lower().replace("\u03bc", "\u00b5")
    plain = re.sub(r"[\u2070\u00b9\u00b2\u00b3\u207b]+", lambda found: "^" + found[0].translate(_SUPERSCRIPTS), plain)
    plain = re.sub(r"\s*[·⋅*.]\s*|(?<=[a-z])\s+(?=[a-z])", "*", plain)
    return _UNITS.get(plain) or _UNITS.get(plain.replace(" ", "").replace("*", ""))


def unit_in(name: str) -> str:
    """Return the unit that a column's name ends in: ``Drehzahl [1/min]``, ``n_rpm``, ``n / min⁻¹``; else nothing."""
    return _unit_at_the_end(name) or _unit_at_the_end(called(name))


def _unit_at_the_end(name: str) -> str:
    found = _IN_BRACKETS.search(name)
    text = "" if found is None else (found[1] or found[2] or "").strip()
    if unit_of(text):
        return text
    lower = name.lower()
    if _TIME_IN_S.fullmatch(lower):
        return "s"
    for suffix, unit in _SUFFIXES.items():
        if lower.endswith((f"_{suffix}", f" {suffix}")):
            return unit
    after = _AFTER_WORD.search(name)
    return after[1] if after is not None and unit_of(after[1]) else ""


def without_unit(name: str) -> str:
    """Return a column's name without the unit that it ends in."""
    bare = _NAMED_AT_THE_END.sub("", name)
    after = _AFTER_WORD.search(bare)
    if after is not None and unit_of(after[1]):
        bare = bare[: after.start()]
    return bare or name


def called(path: str) -> str:
    """Return the part of a channel's path that tells what it is."""
    parts = [part.strip() for part in re.split(r"[./]", path) if part.strip()]
    telling = [part for part in parts if not WITHOUT_MEANING.fullmatch(part)]
    return (telling or parts or [path])[-1]


class Role(Enum):
    """What a column is in a model; the value is the word for people."""

    TIME = "time"
    TORQUE = "torque"
    SPEED = "speed"
    POSITION = "position"
    FORCE = "force"
    ACCELERATION = "acceleration"


EXPECTED: Final = {
    Role.TIME: (Quantity.TIME,),
    Role.TORQUE: (Quantity.TORQUE, Quantity.FORCE),
    Role.SPEED: (Quantity.SPEED, Quantity.VELOCITY),
    Role.POSITION: (Quantity.ANGLE, Quantity.LENGTH),
    Role.FORCE: (Quantity.FORCE, Quantity.TORQUE),
    Role.ACCELERATION: (),
}
"""Quantities that a column of a role may be of."""


def scale_of(table: Table, column: str, role: Role, given: float | None) -> float:
    """Return what a column is multiplied by to be in SI units."""
    if given is not None:
        return given
    text = table.units.get(column, "")
    unit = unit_of(text) if text else None
    if unit is None or unit.quantity is Quantity.OTHER:
        return 1.0
    if unit.quantity in EXPECTED[role]:
        return unit.factor
    raise RecordingError(table.path, _not_of_the_role(column, text, unit, role))


def _not_of_the_role(column: str, text: str, unit: Unit, role: Role) -> str:
    if unit.quantity is Quantity.SHARE:
        return (
            f"column {column}: expected a {role.value} in a unit of its own, got one in {text} of a rated value that "
            f"the file does not say. Give the scale: {role.value} = {{ column = {column!r}, scale = RATED * "
            f"{unit.factor:g} }} with RATED in SI units, worked out."
        )
    return (
        f"column {column}: expected a {role.value}, got a {unit.quantity.value} in {text}. Are two columns swapped in "
        "[signals]? Where it is right as it is, give its scale."
    )


def wrapped_at(values: FloatArray) -> float | None:
    """Return where a reading was stored with sign and read without; None where it was not.

    It jumps by nearly the whole range of a counter, between values near 0 and values near its end, where the next
    reading of a motion is. A counter has 8, 16 or 32 bit of the least step of the readings.
    """
    seen = values[np.isfinite(values)]
    if seen.size < 3 or seen.min() < 0.0:
        return None
    steps = np.abs(np.diff(seen))
    jumps = steps > 0.5 * seen.max()
    if not jumps.any() or jumps.all():
        return None
    resolution = float(np.diff(np.unique(seen)).min())
    usual = float(steps[~jumps].max())
    for bits in WRAPS_BITS:
        end = resolution * 2.0**bits
        halfway = (seen > 0.25 * end) & (seen < 0.75 * end)
        put_right = np.abs(np.diff(with_sign(seen, end)))
        if 0.75 * end <= seen.max() <= end and not halfway.any() and put_right.max() <= STEP_RATIO * usual:
            return end
    return None


def with_sign(values: FloatArray, wraps_at: float) -> FloatArray:
    """Return a reading that wraps with the sign it had."""
    signed: FloatArray = np.where(values >= 0.5 * wraps_at, values - wraps_at, values)
    return signed
