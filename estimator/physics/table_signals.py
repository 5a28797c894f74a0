"""What a curve is a function of, in a simulation: where it was, and whether it went beyond the curve's knots."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimator.physics.curve import slope_at_knot
from estimator.physics.driveline import Case, EffectValue, Motion, Structure, unit
from estimator.physics.inputs import recorded_shaft_torque
from estimator.physics.joint import imposed_in
from estimator.physics.kernel import state_vector
from estimator.physics.layout import Grid, flat_values, slot
from estimator.physics.motion import motor_angle
from estimator.physics.simulate import simulate_each
from estimator.physics.tables import COUNT, PLACES, TABLES, Table, table_of
from estimator.signals.record import FloatArray, Record

_STATES = {
    "motor_speed": (state_vector.SPEED,),
    "shaft_twist": (state_vector.TWIST,),
    "shaft_rate": (state_vector.SPEED, state_vector.LOAD_SPEED),
    "load_speed": (state_vector.LOAD_SPEED,),
}
"""States of the line whose first is, or whose difference is, what the curve is over."""


def signal_of(place: str, grid: Grid, record: Record, case: Case) -> FloatArray:
    """Return what the curve at a place is over in a simulation of a recording, shape (N,)."""
    if place == "torque":
        return recorded_shaft_torque(record, case.p)
    if place == "load_angle":
        return motor_angle(record)
    if grid.structure is Structure.JOINT:
        imposed = imposed_in(record)
        return imposed.twist + case.start.twist_rad if place == "shaft_twist" else imposed.rate
    first, *second = (simulate_each(grid, record, [case], state)[0] for state in _STATES[place])
    return first - second[0] if second else first


def beyond_knots(
    effects: Mapping[str, Mapping[str, EffectValue]], grid: Grid, record: Record, case: Case, motion: Motion
) -> tuple[str, ...]:
    """Return a sentence for each of a model's curves beyond whose knots a simulation went."""
    found = []
    for name in effects:
        if name not in TABLES or PLACES[table_of(name, effects[name]).place].periodic:
            continue
        table = table_of(name, effects[name])
        signal = signal_of(table.place, grid, record, case)
        low, high = float(np.nanmin(signal)), float(np.nanmax(signal))
        if low < table.knots[0] or high > table.knots[-1]:
            of = unit(PLACES[table.place].dimension, motion)
            found.append(
                f"tables.{table.place}: {PLACES[table.place].over} went from {low:.4g} to {high:.4g} {of}, the knots "
                f"hold {table.knots[0]:.4g} to {table.knots[-1]:.4g}: beyond them the curve is a straight line that no "
                "recording has shown"
            )
    return tuple(found)


def slopes_of(table: Table) -> list[float]:
    """Return the slopes of a curve from knot to knot [Nm/unit of the place]."""
    return [float(slope) for slope in np.diff(table.values) / np.diff(table.knots)]


def slopes_at_knots(table: Table) -> list[float]:
    """Return the slopes of a curve at its knots [Nm/unit of the place]."""
    p = flat_values({}, {table.name: {key: each.value for key, each in table.effect().items()}})
    count, last = slot(table.name, COUNT), len(table.knots) - 1
    wraps = PLACES[table.place].periodic
    return [float(slope_at_knot(p, count, i, last, wraps)) for i in range(last + 1)]
