"""Dry friction at the motor whose bristles bend before they slide.

A contact under friction is a spring until it breaks away; sliding, it follows the Stribeck curve ``g``, behind by a
distance and not by a time::

    dT_f/dt = s (w - |w| T_f / g(w)),    s = (T_c + T_x) / x_b

with the deflection ``x_b`` at breakaway (Dahl, AIAA J. 14(12), 1976; with g, Canudas de Wit, Olsson, Åström and
Lischinsky, IEEE Trans. Automat. Contr. 40(3), 1995). At a constant speed it has an exact solution. It is taken for half
a sub-step before the line moves under this torque, and for half a one behind (Strang's splitting, of second order).
"""

from __future__ import annotations

from estimator.abreast import choose, like
from estimator.compiled import inlined
from estimator.physics.kernel import slots
from estimator.physics.kernel.conditions import with_friction
from estimator.physics.kernel.state_vector import Conditions
from estimator.physics.laws import LEAST, fading
from estimator.signals.record import FloatArray


@inlined
def breakaway(p: FloatArray) -> float:
    """Return the dry friction of all laws at the motor, next to standstill [Nm]."""
    return float(p[slots.COULOMB] + p[slots.STRIBECK_COULOMB] + p[slots.STRIBECK])


@inlined
def sliding(speed: float, p: FloatArray) -> float:
    """Return what they come to while it slides at a speed [Nm]."""
    ratio = speed / max(p[slots.STRIBECK_SPEED], LEAST)
    torque: float = p[slots.COULOMB] + p[slots.STRIBECK_COULOMB] + p[slots.STRIBECK] * fading(ratio * ratio)
    return torque


@inlined
def slid(speed: float, p: FloatArray) -> float:
    """Return the torque against a motion that has gone on for long [Nm]."""
    limit = sliding(speed, p)
    return choose(speed > 0.0, limit, choose(speed < 0.0, -limit, 0.0))


@inlined
def stiffness(now: Conditions, p: FloatArray) -> float:
    """Return the bristles' stiffness [Nm/rad], which is none that the step can't follow."""
    stiff: float = breakaway(p) / max(p[slots.COULOMB_PRESLIDING], p[slots.STRIBECK_PRESLIDING])
    return min(stiff, now.fastest * now.fastest / now.inverse_motor)


@inlined
def bent(torque: float, speed: float, now: Conditions, p: FloatArray, time_s: float) -> float:
    """Return the bristles' torque after a time at constant speed [Nm]."""
    left = fading(abs(speed) * stiffness(now, p) * time_s / max(sliding(speed, p), LEAST))
    return slid(speed, p) * (1.0 - left) + torque * left


@inlined
def rubbed(now: Conditions, torque: float) -> Conditions:
    """Return the conditions with the bristles' torque [Nm] in place of the other laws of dry friction at the motor."""
    return with_friction(now, now.torque - torque, now.load, like(0.0, now.dry_motor), now.dry_load)
