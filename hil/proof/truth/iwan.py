"""Hysteresis of the shaft as Iwan's parallel row of Jenkins elements: springs in series with dry sliders.

W. D. Iwan, J. Appl. Mech. 33 (1966). The elements are equally stiff and begin to slide one after another, at evenly
spaced twists. Each element's deflection is a state: it follows the twist and can't be greater than its own limit.
"""

from __future__ import annotations

from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import FloatArray, Physics

ELEMENTS = 8


@compiled
def follow(deflections: FloatArray, p: Physics, twist_change: float) -> None:
    """Let the elements follow a change of the twist; exact, however large. ``deflections`` has shape (ELEMENTS,)."""
    for element in range(ELEMENTS):
        limit = p.hysteresis_slip_rad * (element + 1.0) / ELEMENTS
        deflections[element] = min(limit, max(-limit, deflections[element] + twist_change))


@compiled
def torque(deflections: FloatArray, p: Physics) -> float:
    """Return the torque of all elements together [Nm]."""
    deflection = 0.0
    for element in range(ELEMENTS):
        deflection += deflections[element]
    return p.hysteresis_stiffness * deflection / ELEMENTS
