"""Laws that are a torque at a shaft which another program turns: their torque follows from that shaft's speed.

Over a step the law acts on the inertia next to the flange, driven as the two steps before let expect. That is the
compiled simulation of one mass, with all forms of the laws; what its speed lacks at the end is the law's mean torque.
A torque that only followed from the speed at the beginning would shake dry friction to and fro at standstill.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from estimator.physics.catalogue import BUILT_IN
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.inputs import initial_state
from estimator.physics.kernel import integration, state_vector
from estimator.physics.layout import flat, slot
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.simulate import MASSES
from estimator.signals.record import FloatArray

SUBSTEPS = 4

AT_MOTOR = tuple(each.name for each in BUILT_IN.values() if each.element is Element.MOTOR)
"""Laws at the first shaft."""

AT_LOAD = tuple(
    each.name
    for each in BUILT_IN.values()
    if each.element is Element.LOAD and not each.profile and each.name != "tyre_slip"
)
"""Laws at the load; a profile goes through the load's own input, and a tyre is a part of the line."""

FREE = DrivelineModel(Structure.ONE_MASS, {"J_M": Parameter(1.0, 0.0), "b_M": Parameter(0.0, 0.0)})
"""A free inertia."""


def slots_of(effects: Collection[str]) -> list[int]:
    """Return the places of some effects' parameters."""
    return [slot(name, parameter.name) for name in effects for parameter in BUILT_IN[name].parameters]


def with_only(p: FloatArray, places: Collection[int]) -> FloatArray:
    """Return the parameters of a free inertia with those at some places."""
    free = flat(FREE)
    free[list(places)] = p[list(places)]
    return free


class Flange:
    """Torque of laws at a shaft, step by step.

    ``p`` has their parameters, such as ``with_only`` gives; ``inertia`` is that next to the flange [kg m^2];
    ``sign_width`` the speed within which dry friction changes sign [rad/s].
    """

    def __init__(self, p: FloatArray, inertia: float, sign_width: float) -> None:
        self._p, self._inertia, self._sign_width = p.copy(), inertia, sign_width
        self._p[slot("", "J_M")] = inertia
        self._state: FloatArray | None = None
        self._before = 0.0
        self._against = 0.0
        self._input = 0.0
        self._rest: float | None = None

    def against(self, time_s: float, step_s: float, speed: float, angle: float, input_nm: float) -> float:
        """Return the laws' mean torque against the motion over a step that begins at this time, speed and angle [Nm].

        ``input_nm`` is what of the torque on the shaft is known; the rest is taken to change as it did before.
        """
        drive = input_nm
        if self._state is None:
            self._state = initial_state(InitialCondition(0.0, 0.0, speed), 0.0, angle, self._p)
        else:
            rest = self._inertia * (speed - self._before) / step_s + self._against - self._input
            drive = input_nm + rest + (0.0 if self._rest is None else rest - self._rest)
            self._rest = rest
        self._state[state_vector.SPEED], self._state[state_vector.ANGLE] = speed, angle
        integration.integrate_period(
            MASSES[Structure.ONE_MASS],
            (),
            step_s,
            SUBSTEPS,
            self._sign_width,
            0,
            1,
            time_s,
            np.full(2, drive),
            np.zeros(2),
            np.array([angle, angle + speed * step_s]),
            np.zeros(0),
            self._p,
            self._state,
            np.array([state_vector.SPEED]),
            False,
            np.zeros((1, 2)),
            np.zeros((2, 0)),
        )
        self._before, self._input = speed, input_nm
        self._against = drive - self._inertia * float(self._state[state_vector.SPEED] - speed) / step_s
        return self._against
