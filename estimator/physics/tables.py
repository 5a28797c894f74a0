"""Laws without a name: a curve of a torque over what happens at one place, as data.

Each is next to whatever the line has there, so that a curve of zeros is no law. The torque over the shaft's twist takes
the shaft's damping with it: where the curve makes the shaft stiffer by a share, it is damped more by that share, and
where nothing holds it, not at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from estimator.physics.curve import MOST_KNOTS
from estimator.physics.driveline import EffectValue, Motion, Structure
from estimator.physics.effect import EVERY_LINE, WITH_SHAFT, WITH_SPRING, Effect, EffectParameter, Element

PREFIX = "table_"
"""What the name of an effect begins with that is a table; the rest is its place in the model file."""

FEWEST_KNOTS = 2

COUNT, DAMPING, PHASE = "knots", "damping", "phase_rad"

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Table:
    """A curve as the model file has it."""

    place: str  # key of ``PLACES``
    knots: tuple[float, ...]  # rising [unit of the place]
    values: tuple[float, ...]  # as many [Nm]
    ci95: tuple[Interval, ...] | None = None  # as many, of the values
    damping: float = 0.0  # of a shaft's twist: damping of its own over the rate [Nm s/rad]

    @property
    def name(self) -> str:
        """Name of the effect that holds it in a model."""
        return PREFIX + self.place

    def effect(self) -> dict[str, EffectValue]:
        """Return it as values of its effect."""
        found = {COUNT: EffectValue(float(len(self.knots)))}
        found |= {f"knot_{i + 1}": EffectValue(knot) for i, knot in enumerate(self.knots)}
        bands = self.ci95 or (None,) * len(self.values)
        pairs = enumerate(zip(self.values, bands, strict=True))
        found |= {f"value_{i + 1}": EffectValue(value, band) for i, (value, band) in pairs}
        return found | ({DAMPING: EffectValue(self.damping)} if self.damping else {})


def table_of(name: str, values: Mapping[str, EffectValue]) -> Table:
    """Return what an effect of this name holds as a table."""
    own = [values[f"value_{i}"] for i in range(1, MOST_KNOTS + 1) if f"value_{i}" in values]
    bands = tuple(each.ci95 for each in own if each.ci95 is not None)
    return Table(
        name.removeprefix(PREFIX),
        tuple(values[f"knot_{i}"].value for i in range(1, MOST_KNOTS + 1) if f"knot_{i}" in values),
        tuple(each.value for each in own),
        bands if own and len(bands) == len(own) else None,
        values[DAMPING].value if DAMPING in values else 0.0,
    )


@dataclass(frozen=True, slots=True)
class TablePlace:
    """Where a curve acts."""

    element: Element  # part of the line
    over: str  # what it is a function of, in words
    dimension: str  # of that
    structures: frozenset[Structure]  # lines that have this part
    sign: str  # what a positive value does
    periodic: bool = False  # whether it repeats with every turn


PLACES: Mapping[str, TablePlace] = MappingProxyType(
    {
        "torque": TablePlace(
            Element.TORQUE_PATH, "the torque that is read", "torque", EVERY_LINE, "torque more on the motor"
        ),
        "motor_speed": TablePlace(
            Element.MOTOR, "the speed of the motor", "speed", EVERY_LINE, "torque against a motion forward"
        ),
        "shaft_twist": TablePlace(
            Element.SHAFT, "the twist of the shaft", "angle", WITH_SPRING, "torque more that the shaft carries"
        ),
        "shaft_rate": TablePlace(
            Element.SHAFT, "the rate of the shaft's twist", "speed", WITH_SPRING, "torque more that the shaft carries"
        ),
        "load_speed": TablePlace(
            Element.LOAD, "the speed of the load", "speed", WITH_SHAFT, "torque against a motion forward"
        ),
        "load_angle": TablePlace(
            Element.LOAD, "the angle of the load", "angle", EVERY_LINE, "torque against a motion forward", True
        ),
    }
)
"""Places of a law without a name, by their key in the model file, along the chain from torque to load."""


def _entry(place: str, at: TablePlace) -> Effect:
    knots = [
        EffectParameter(f"knot_{i}", at.dimension, math.inf, -math.inf, math.inf, f"knot {i} over {at.over}", True)
        for i in range(1, MOST_KNOTS + 1)
    ]
    values = [
        EffectParameter(f"value_{i}", "torque", 0.0, -math.inf, math.inf, f"{at.sign}, at knot {i}", True)
        for i in range(1, MOST_KNOTS + 1)
    ]
    more = []
    if place == "shaft_twist":
        more = [EffectParameter(DAMPING, "damping", 0.0, 0.0, math.inf, "damping of its own over the rate", True)]
    if at.periodic:
        turn = EffectParameter(PHASE, "angle", 0.0, -math.inf, math.inf, "angle at its start, own", True, True)
        more = [turn]

    def sentence(values: Mapping[str, float], motion: Motion) -> str:
        return f"a torque over {at.over} that has no name, a curve through {values[COUNT]:.0f} knots"

    return Effect(
        name=PREFIX + place,
        element=at.element,
        title=f"a torque over {at.over}, without a name",
        law=f"a piecewise cubic curve over {at.over}",
        source="Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984",
        excited_by=f"a wide range of {at.over}",
        parameters=(
            EffectParameter(COUNT, "", 0.0, 0.0, MOST_KNOTS, "number of knots", most=MOST_KNOTS),
            *knots,
            *values,
            *more,
        ),
        structures=at.structures,
        resembles=(),
        text=sentence,
        phases={PHASE: COUNT} if at.periodic else {},
        waving=at.periodic,
    )


TABLES: Mapping[str, Effect] = MappingProxyType({PREFIX + place: _entry(place, at) for place, at in PLACES.items()})
"""Effects that are a table, by name: the kernel has them, the catalogue, which names physics, does not."""


def table_faults(table: Table) -> Iterator[tuple[str, str, object]]:  # noqa: C901  # a fault each
    """Yield what is wrong with a table: key, what was expected, what came."""
    count, at = len(table.knots), PLACES[table.place]
    fewest = FEWEST_KNOTS + at.periodic
    if not fewest <= count <= MOST_KNOTS:
        yield "knots", f"{fewest} to {MOST_KNOTS} knots", count
    if not all(map(math.isfinite, table.knots)) or any(b <= a for a, b in _pairs(table.knots)):
        yield "knots", "finite numbers, each larger than the one before", list(table.knots)
    if len(table.values) != count:
        yield "values", f"as many as knots, {count}", len(table.values)
    elif not all(map(math.isfinite, table.values)):
        yield "values", "finite numbers", list(table.values)
    elif at.periodic and count and table.values[0] != table.values[-1]:
        yield "values", f"the last one like the first, {table.values[0]:g}, since it repeats", table.values[-1]
    if table.ci95 is not None:
        if len(table.ci95) != len(table.values):
            yield "ci95", f"an interval for each value, {len(table.values)}", len(table.ci95)
        elif any(low > high for low, high in table.ci95):
            yield "ci95", "the lower bound first in every interval", [list(each) for each in table.ci95]
    if not (math.isfinite(table.damping) and table.damping >= 0.0):
        yield "damping", "a finite number, 0 or greater", table.damping
    if table.damping and table.place != "shaft_twist":
        yield "damping", "none but over shaft_twist", table.damping


def _pairs(values: Sequence[float]) -> list[tuple[float, float]]:
    return list(zip(values[:-1], values[1:], strict=True))  # noqa: RUF007
