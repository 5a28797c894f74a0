"""Where each quantity stands in the state array."""

from __future__ import annotations

from enum import IntEnum

from hil.proof.truth import iwan


class State(IntEnum):
    """Index of each quantity: M motor, X extra inertia, L load (wheels), V vehicle, G generator.

    What is not there (CONTRACT's two masses are M and L) has its place all the same and nothing reads it. The Jenkins
    elements' deflections begin at ``SLIDERS``.
    """

    ANGLE_M = 0
    ANGLE_L = 1
    SPEED_M = 2
    SPEED_L = 3
    BRISTLE_M = 4
    BRISTLE_L = 5
    MAXWELL_NM = 6
    INVERTER_NM = 7
    TIME_S = 8
    ANGLE_X = 9
    SPEED_X = 10
    SPEED_V = 11
    SLIP = 12
    SPEED_G = 13
    FILTERED = 14
    FILTERED_RATE = 15
    MAXWELL_FAST_NM = 16
    SLIDERS = 17


SPEEDS = (State.SPEED_M, State.SPEED_X, State.SPEED_L, State.SPEED_V, State.SPEED_G, State.FILTERED)
"""All that has the speed of the whole line when it rolls as one."""

STATES = State.SLIDERS + iwan.ELEMENTS
"""Length of the state array."""
