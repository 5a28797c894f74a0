"""The linear line as disturbances see it: a chain of inertias and shafts, sampled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.signals.outputs import by_output
from estimator.signals.record import FloatArray, Location, OutputKind, Record


@dataclass(frozen=True, slots=True)
class Line:
    """The linear line as disturbances see it, sampled.

    Attributes
    ----------
    f : ndarray, shape (n, n)
    torque, load, shaft : ndarray, shape (n,)
        How a torque held for a sample, at the motor, against the load and more in the first shaft, moves the state.
    h : ndarray, shape (C, n)
        How each output shows the state.
    direct : float
        How the load shows in the output at once: 1 for a joint, whose torque is read.
    """

    f: FloatArray
    torque: FloatArray
    load: FloatArray
    h: FloatArray
    direct: float = 0.0
    shaft: FloatArray = field(default_factory=lambda: np.zeros(0))


def line_of(result: FitResult) -> Line:
    """Return the linear line with a fit's values, as the recordings' outputs show it.

    Effects beyond it do not change how disturbances spread.
    """
    records, structure = result.problem.records, result.problem.grid.structure
    outputs = [records[part.start] for part in by_output(records)]
    if structure is Structure.JOINT:
        nothing = np.zeros(0)
        return Line(np.zeros((0, 0)), nothing, nothing, np.zeros((len(outputs), 0)), 1.0)
    values = {name: float(result.p[slot("", name)]) for name in structure.parameter_names}
    a, at_motor, at_load = _continuous(values)
    n = a.shape[0]
    h = np.array([_seen(record, a, values) / record.unit for record in outputs])
    joined = np.zeros((n + 3, n + 3))
    joined[:n, :n], joined[:n, n], joined[:n, n + 1], joined[:n, n + 2] = a, at_motor, at_load, _in_shaft(values)
    moved = expm(joined * outputs[0].sample_time_s)
    keep = list(range(n if h[:, -1].any() else n - 1))  # the angle stands last
    return Line(moved[np.ix_(keep, keep)], moved[keep, n], moved[keep, n + 1], h[:, keep], 0.0, moved[keep, n + 2])


def _seen(record: Record, a: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Return how the state of a chain shows in an output; what a torque adds to an acceleration at once is left out."""
    h, is_load = np.zeros(a.shape[0]), record.location is Location.LOAD
    speed = h.size - 2 if is_load else 0
    if record.kind is OutputKind.TORQUE:
        h[:3] = values["c"], values["k"], -values["c"]
    elif record.kind is OutputKind.ACCELERATION:
        h[:] = a[speed]
    elif record.kind is OutputKind.POSITION:
        h[-1], h[1:-1:2] = 1.0, -float(is_load)  # behind the shafts less their twists
    else:
        h[speed] = 1.0
    return h


def _in_shaft(values: Mapping[str, float]) -> FloatArray:
    """Return how a torque more in the first shaft drives a chain: back on the motor, and on what is behind it."""
    inertias = [values[name] for name in ("J_M", "J_2", "J_L") if name in values]
    at_shaft = np.zeros(2 * len(inertias))
    if len(inertias) > 1:
        at_shaft[[0, 2]] = -1.0 / inertias[0], 1.0 / inertias[1]
    return at_shaft


def _continuous(values: dict[str, float]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return state matrix and inputs of a chain: speeds and twists in turn, last the motor's angle."""
    inertias = [values[name] for name in ("J_M", "J_2", "J_L") if name in values]
    springs = [(values[k], values[c]) for k, c in (("k", "c"), ("k_2", "c_2")) if k in values]
    viscous = [values["b_M"], *[0.0] * (len(inertias) - 2), *([values["b_L"]] if "b_L" in values else [])]
    n = 2 * len(inertias)
    a, at_motor, at_load = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    a[n - 1, 0] = 1.0
    for i, (inertia, b) in enumerate(zip(inertias, viscous, strict=True)):
        a[2 * i, 2 * i] -= b / inertia
    for i, (k, c) in enumerate(springs):
        left, twist, right = 2 * i, 2 * i + 1, 2 * i + 2
        a[twist, left], a[twist, right] = 1.0, -1.0
        for speed, sign, inertia in ((left, -1.0, inertias[i]), (right, 1.0, inertias[i + 1])):
            a[speed, [twist, left, right]] += sign / inertia * np.array([k, c, -c])
    at_motor[0] = 1.0 / inertias[0]
    at_load[n - 2] = -1.0 / inertias[-1]
    return a, at_motor, at_load
