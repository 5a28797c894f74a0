"""Road grade: a load torque that wanders slowly over a recording, as the road goes up and down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, Untestable
from estimator.physics.motion import torque_scale
from estimator.signals.record import FloatArray, Record

KNOT_SPACING_S = 2.0
"""A road's grade keeps its value over tens of metres: 2 s at a bus's 10 m/s are 20 m."""

DEGREE = 3
"""Cubic: a road is laid out without kinks, so a profile with an edge is something else."""

SHORTEST_S = 4 * KNOT_SPACING_S
"""A profile needs a few knots; a shorter recording can't tell it from the constant load."""


def basis(time_s: FloatArray, at_s: FloatArray | None = None) -> FloatArray:
    """Return the profile's basis: cubic B-splines, the first left out (their sum is the constant load).

    Parameters
    ----------
    time_s : ndarray, shape (N,)
        Times of the recording, which the knots span [s].
    at_s : ndarray, shape (M,), optional
        Where to evaluate; at ``time_s`` by default.

    Returns
    -------
    ndarray, shape (K, M)
        Value of each of the K splines at each time.
    """
    from scipy.interpolate import BSpline  # a third of a second that few need

    first, last = float(time_s[0]), float(time_s[-1])
    inner = np.linspace(first, last, max(2, round((last - first) / KNOT_SPACING_S) + 1))
    knots = np.concatenate([[first] * DEGREE, inner, [last] * DEGREE])
    at = time_s if at_s is None else at_s
    design = BSpline.design_matrix(np.clip(at, first, last), knots, DEGREE).toarray()
    splines: FloatArray = np.ascontiguousarray(design.T[1:])
    return splines


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use."""
    return (0.05 * torque_scale(records),)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start, a flat road: the problem is linear in the profile."""
    return [(0.0,)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a recording long enough for a profile."""
    if any(record.time_s[-1] - record.time_s[0] >= SHORTEST_S for record in records):
        return None
    return Untestable(
        f"every recording is shorter than {SHORTEST_S:g} s: a slow profile is not separable from a constant load",
        "cruise",
    )


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    torque = unit("torque", motion)
    return f"the load torque varies slowly by {values['grade_rms_nm']:.3g} {torque} (rms), as on a road with grades"


EFFECT = Effect(
    name="road_grade",
    element=Element.LOAD,
    title="road grade",
    law="T_load = T_0 + g(t), g a cubic spline over time",
    source="gravity on a slope, m g sin(grade): Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992",
    excited_by="driving on a road that is not level",
    parameters=(EffectParameter("grade_rms_nm", "torque", 0.0, 0.0, float("inf"), "size of the profile: its rms"),),
    structures=EVERY_LINE,
    resembles=(
        "torque_derating",
        "aerodynamic_drag",
        "brake_drag",
        "load_imbalance",
        "inertia_change",
        "warming_friction",
    ),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    profile=True,
)
