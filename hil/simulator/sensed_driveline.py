"""What sensors along a driveline show that is stepped period by period."""

from __future__ import annotations

import numpy as np

from estimator.physics.kernel import integration
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import MASSES, output_state
from estimator.physics.stepper import SIGN_WIDTH_RAD_S, Stepper
from estimator.signals.record import Location, OutputKind, Record

FINER = 16
"""An acceleration is the slope over an integration step: this many times shorter than those of the simulation."""


class SensedDriveline(Stepper):
    """A stepped driveline with more to measure than the motor's speed.

    Parameters
    ----------
    model
        With its effects.
    period_s
        Length of a step [s].
    """

    def __init__(self, model: DrivelineModel, period_s: float) -> None:
        super().__init__(model, period_s)
        self._structure = model.structure

    def measured(self, kind: OutputKind, at: Location) -> float:
        """Return what an ideal sensor shows now, an acceleration as under the torque that acts until now.

        It is the output before a step that is not taken, or the slope at its beginning.

        Raises
        ------
        BadModel
            If the structure has no such output.
        """
        is_slope = kind is OutputKind.ACCELERATION
        size, last = self._torque.size, self._torque.size - 1
        out, slopes = np.zeros((1, size)), np.zeros((2, size))
        integration.integrate_period(
            MASSES[self._structure],
            (),
            self._period_s,
            FINER * self._substeps if is_slope else self._substeps,
            SIGN_WIDTH_RAD_S,
            last,
            size,
            (self._steps - last) * self._period_s,
            np.append(self._torque[1:], self._torque[-1]),
            self._load,
            self._angle,
            self._p,
            self._state.copy(),
            np.array([output_state(_recording_of(kind, at), self._structure)]),
            False,
            out,
            slopes,
        )
        return float(slopes[1, last] if is_slope else out[0, last])


def _recording_of(kind: OutputKind, at: Location) -> Record:
    """Return a recording of such an output, as a model is asked for one."""
    nothing = np.zeros(1)
    return Record("channel", 1.0, nothing, nothing[:, np.newaxis], nothing, np.ones(1, dtype=np.bool_), kind, at)
