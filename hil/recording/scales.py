"""The scale of a column: as it was given, else of its unit; and readings that wrap, put right where that was said.

A unit is used only where no scale is given. One of another quantity than the column's role is refused, for two columns
are swapped then; so is a share of a rated value, for what that is the file does not say.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

import numpy as np

from hil.errors import RecordingError
from hil.recording.table import FloatArray, Table
from hil.recording.units import Quantity, Unit, unit_of


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

WRAPS_BITS: Final = (8, 16, 32)
"""Lengths of the whole numbers that loggers store."""

ALIKE: Final = 4.0
"""How much larger a step may be where the reading begins anew, put right, than the largest other step."""


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
        if 0.75 * end <= seen.max() <= end and not halfway.any() and put_right.max() <= ALIKE * usual:
            return end
    return None


def with_sign(values: FloatArray, wraps_at: float) -> FloatArray:
    """Return a reading that wraps with the sign it had."""
    signed: FloatArray = np.where(values >= 0.5 * wraps_at, values - wraps_at, values)
    return signed
