"""What a line is made of, known when its simulation is compiled: what it lacks costs nothing."""

from __future__ import annotations

from typing import Any, NamedTuple

from estimator.compiled import inlined
from estimator.lanes import some
from estimator.physics.kernel import slots
from estimator.signals.record import FloatArray


class Line(NamedTuple):
    """What a line is made of.

    Attributes
    ----------
    masses : int
        1, 2 or 3.
    elastic : bool
        Whether the first shaft is a spring and a damper, and no law next to them.
    sliding : bool
        Whether there may be a slider inside that shaft.
    extended : bool
        Whether it has states beyond those of its masses and a slider: an extra mode, a tyre that slips, a shaft that
        relaxes.
    own : tuple
        Empty, or the torque readings, a user's own laws as one function, and what they are given of the moment: time
        [s] and torque reading [Nm].
    """

    masses: int
    elastic: bool
    sliding: bool
    extended: bool
    own: tuple[Any, ...]


@inlined
def is_elastic(p: FloatArray) -> bool:
    """Tell whether the first shaft is a spring and a damper, and no law next to them."""
    bent = p[slots.GAP] > 0.0 or p[slots.HARDENING] != 0.0 or p[slots.STAGE] != 0.0
    sliding = p[slots.SLIDER] != 0.0 or p[slots.SLIDER_INSIDE] > 0.0
    jointed = p[slots.CARDAN] != 0.0 or p[slots.CARDAN_ANGLE] != 0.0 or p[slots.CARDAN_SHARE] != 0.0
    return not (bent or sliding or jointed)


@inlined
def is_bristled(p: FloatArray) -> bool:
    """Tell whether dry friction, at the motor or at the load, deflects before it slides."""
    return is_bristled_at_motor(p) or is_bristled_at_load(p)


@inlined
def is_bristled_at_motor(p: FloatArray) -> bool:
    """Tell whether dry friction at the motor deflects before it slides."""
    return some(p[slots.COULOMB_PRESLIDING] > 0.0) or some(p[slots.STRIBECK_PRESLIDING] > 0.0)


@inlined
def is_bristled_at_load(p: FloatArray) -> bool:
    """Tell whether dry friction at the load deflects before it slides, that of a brake included."""
    return some(p[slots.COULOMB_LOAD_PRESLIDING] > 0.0) or some(p[slots.BRAKE_PRESLIDING] > 0.0)


@inlined
def is_extended(p: FloatArray) -> bool:
    """Tell whether a line has states beyond those of its masses and a slider."""
    return bool(p[slots.BRANCH_INERTIA] > 0.0 or is_within(p) or p[slots.SLIP] > 0.0 or p[slots.RELAXING] > 0.0)


@inlined
def is_within(p: FloatArray) -> bool:
    """Tell whether the inertia of an extra mode is in the line, before the shaft or behind it, and not next to it."""
    return some(p[slots.BETWEEN] > 0.0) or some(p[slots.BEHIND] > 0.0)
