"""What a law without a name looks like, in words, and as the shortest formula within its band."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from estimator.diagnosis.thresholds import Curves
from estimator.physics.laws import beyond_gap
from estimator.physics.tables import Table
from estimator.signals.record import FloatArray

SIZES = np.linspace(0.01, 0.9, 90)
"""Halves of a dead band that are tried, as shares of the knots' reach."""

Function = Callable[[FloatArray], FloatArray]

TERMS: dict[str, Function] = {
    "x": lambda x: x,
    "x^3": lambda x: x**3,
    "x |x|": lambda x: x * np.abs(x),
    "sign(x)": np.sign,
    "max(x, 0)": lambda x: np.maximum(x, 0.0),
    "min(x, 0)": lambda x: np.minimum(x, 0.0),
    "|x|": np.abs,
    "x^2": lambda x: x**2,
    "1": np.ones_like,
}
"""Terms of a formula, the plainest first."""

MOST_TERMS = 3


def _total(table: Table, slope: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return knots, the torque over them with the line's own slope, and how far off it may be described."""
    x, values = np.array(table.knots), np.array(table.values)
    total = values + slope * x
    half = np.zeros(x.size)
    if table.ci95 is not None:
        half = 0.5 * np.array([high - low for low, high in table.ci95])
    span = float(np.ptp(total)) or float(np.ptp(values)) or 1.0  # a curve may take away all that the line has
    return x, total, np.clip(half, Curves.WITHIN * span, Curves.WIDEST * span)


def shortest_formula(table: Table, slope: float) -> str:
    """Return the formula of fewest terms within the band of a curve and the line's own slope; "" without one."""
    x, total, room = _total(table, slope)
    for count in range(1, MOST_TERMS + 1):
        fits = []
        for names in combinations(TERMS, count):
            columns = np.column_stack([TERMS[name](x) for name in names])
            found: FloatArray = np.linalg.lstsq(columns / room[:, None], total / room, rcond=1e-9)[0].astype(np.float64)
            worst = float(np.max(np.abs(columns @ found - total) / room))
            if worst <= 1.0:
                fits.append((worst, names, found))
        if fits:
            _, names, found = min(fits, key=lambda each: each[0])
            return _written(names, found)
    return ""


def _written(names: tuple[str, ...], found: FloatArray) -> str:
    text = ""
    for name, value in zip(names, found.tolist(), strict=True):
        size = f"{abs(value):.3g}" if name == "1" else f"{abs(value):.3g} {name}"
        text += (f" {'-' if value < 0.0 else '+'} " if text else "-" * (value < 0.0)) + size
    return f"torque = {text}"


def looks_like(table: Table, slope: float) -> str:
    """Return which known law lies within the band, as the rest of a sentence; "" where none does."""
    x, total, room = _total(table, slope)
    if not total.any():
        return "no torque at all"
    if table.place not in ("shaft_twist", "torque"):
        return _drag(x, total, room)
    unit, what = ("rad", "spring") if table.place == "shaft_twist" else ("Nm", "torque")
    reach, top = float(np.abs(x).max()), float(np.abs(total).max())
    shapes: list[tuple[str, Function]] = [
        (f"a {what} that acts one way only", lambda x: np.maximum(x, 0.0)),
        (f"a {what} that acts one way only, backwards", lambda x: np.minimum(x, 0.0)),
    ]
    for half in (SIZES * reach).tolist():
        shapes.append((f"a dead band of {2.0 * half:.3g} {unit}", _beyond(2.0 * half)))
    if np.count_nonzero(np.abs(total) > Curves.AT_LIMIT * top) >= Curves.FEWEST_AT_LIMIT:
        shapes.append((f"a limit of {top:.3g} Nm", _limited(top, total, x)))
    found = []
    for name, shape in shapes:
        column = shape(x) / room
        factor = float(column @ (total / room)) / max(float(column @ column), 1e-300)
        low, high = ((1.0 + sign * Curves.RETUNED) * slope for sign in (-1.0, 1.0))
        factor = 1.0 if "limit" in name else min(max(factor, low), high)
        found.append((name, factor * column * room))
    return _nearest(found, total, room)


def _nearest(found: Sequence[tuple[str, FloatArray]], total: FloatArray, room: FloatArray) -> str:
    """Return the name of the torque that is nearest, in bands; "" where none lies within."""
    off, name = min((float(np.max(np.abs(torque - total) / room)), name) for name, torque in found)
    return name if off <= 1.0 else ""


def _beyond(gap: float) -> Function:
    return lambda x: np.array([beyond_gap(each, gap) for each in x.tolist()])


def _limited(limit: float, total: FloatArray, x: FloatArray) -> Function:
    near = np.abs(total) < Curves.AT_LIMIT * limit
    steep = float(x[near] @ total[near]) / max(float(x[near] @ x[near]), 1e-300)
    return lambda x: np.clip(steep * x, -limit, limit)


def _drag(x: FloatArray, total: FloatArray, room: FloatArray) -> str:
    """Return the same of a torque against a speed."""
    known: dict[str, Function] = {
        "dry friction": np.sign,
        "a drag with the square of the speed": TERMS["x |x|"],
        "viscous friction": TERMS["x"],
    }
    found = []
    for name, function in known.items():
        columns = np.column_stack([function(x), np.ones_like(x)])  # a constant is the load's
        size, constant = np.linalg.lstsq(columns / room[:, None], total / room, rcond=None)[0]
        if not math.isclose(float(size), 0.0, abs_tol=1e-12):
            found.append((f"{name} of {size:.3g} Nm" if name == "dry friction" else name, columns @ [size, constant]))
    return _nearest(found, total, room) if found else ""
