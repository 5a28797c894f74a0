"""A declaration of a law from a table: Python function and ``[laws]`` table, with the words for people to fill in.

What a diagnosis found without a name becomes a law of the user's own that the next diagnosis of such a machine can name
(``hil.config.laws``): its size is 1 where the machine is as this one, 0 where it has nothing of the kind.
"""

from __future__ import annotations

import keyword
from pathlib import Path
from typing import Final

from estimator.physics.driveline import unit
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel
from estimator.physics.table_signals import slopes_at_knots
from estimator.physics.tables import PLACES, TABLES, Table, table_of
from hil.config.model_file import read_model
from hil.errors import ModelFileError, UsageError

LARGEST: Final = 5.0
"""Size up to which such a law is looked for: so many times this machine's."""

_SIGNALS: Final = {
    "torque": "torque",
    "motor_speed": "motor_speed",
    "shaft_twist": "twist",
    "shaft_rate": "motor_speed - load_speed",
    "load_speed": "load_speed",
}
"""What a place's curve is over, from the arguments that every law of a user's own has."""

_FUNCTION: Final = '''\
"""{name}: TODO what it is, in a few words.

From {source}: a torque over {over} that a diagnosis found without a name{looks}.
TODO where such machines have it, and what else it resembles.
"""

KNOTS = {knots}  # {knot_unit}
VALUES = {values}  # Nm: {sign}
SLOPES = {slopes}  # at the knots


def {name}(time_s, motor_speed, load_speed, twist, torque, size):
    """Return the torque of the law [Nm]: {size_says}."""
    x = {signal}
    if x <= KNOTS[0]:
        return {minus}size * (VALUES[0] + SLOPES[0] * (x - KNOTS[0]))
    if x >= KNOTS[-1]:
        return {minus}size * (VALUES[-1] + SLOPES[-1] * (x - KNOTS[-1]))
    i = 0
    while x > KNOTS[i + 1]:
        i += 1
    wide = KNOTS[i + 1] - KNOTS[i]
    straight, first, second = (VALUES[i + 1] - VALUES[i]) / wide, SLOPES[i], SLOPES[i + 1]
    t = (x - KNOTS[i]) / wide
    square, cube = 3.0 * straight - 2.0 * first - second, first + second - 2.0 * straight
    return {minus}size * (VALUES[i] + wide * t * (first + t * (square + t * cube)))
'''

_TABLE: Final = """\
# Paste this into the model file of the next machine of this kind, and give hil diagnose --trust-laws.
[laws.{name}]
function = "{name}:{name}"
element = "{element}"
folder = "."   # of {name}.py, from the model file

[laws.{name}.parameters]
size = {{ unit = "", null = 0.0, low = 0.0, high = {largest}, start = 1.0 }}   # 1 is as on this machine
"""


def declaration(source: Path, name: str, place: str | None) -> dict[str, str]:
    """Return the files of a law of this name, by file name, from a table of a model file.

    Raises
    ------
    UsageError
        Where the name is none for a function, or the model has no table, or several and none is chosen.
    """
    if not name.isidentifier() or keyword.iskeyword(name) or not name.isascii():
        raise UsageError(f"--name {name!r}: expected a name for a Python function, of letters, digits and _")
    model = read_model(source).model
    table = chosen_table(source, model, place)
    if table.place not in _SIGNALS:
        raise ModelFileError(
            source,
            f"tables.{table.place} | expected one of {', '.join(_SIGNALS)}, which a law of your own is given | got it",
        )
    return {f"{name}.py": _function(source, model, table, name), f"{name}.toml": _declared(table, name)}


def chosen_table(source: Path, model: DrivelineModel, place: str | None) -> Table:
    """Return the law without a name that a model has, or the one over a place of those it has."""
    found = {each.place: each for each in (table_of(n, v) for n, v in model.effects.items() if n in TABLES)}
    if not found:
        raise ModelFileError(source, "tables | expected a law without a name, as hil diagnose writes it | got none")
    if place is None and len(found) == 1:
        return next(iter(found.values()))
    if place not in found:
        got = "none of them" if place is None else repr(place)
        raise UsageError(f"--table: expected one of {', '.join(found)}, which {source} has, got {got}")
    return found[place]


def _function(source: Path, model: DrivelineModel, table: Table, name: str) -> str:
    at = PLACES[table.place]
    is_torque = at.element is Element.TORQUE_PATH
    return _FUNCTION.format(
        name=name,
        source=source.name,
        over=at.over,
        looks="" if not table.damping else f", with {table.damping:g} Nm s/rad of damping that is not in the function",
        knots=table.knots,
        knot_unit=unit(at.dimension, model.motion),
        values=table.values,
        sign=at.sign,
        slopes=slopes_at_knots(table),
        signal=_SIGNALS[table.place],
        minus="-" if is_torque else "",
        size_says="against the motor's motion" if is_torque else at.sign,
    )


def _declared(table: Table, name: str) -> str:
    element = PLACES[table.place].element
    element = Element.MOTOR if element is Element.TORQUE_PATH else element
    return _TABLE.format(name=name, element=element.value, largest=LARGEST)
