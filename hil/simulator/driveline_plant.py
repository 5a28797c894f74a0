"""The driveline of a model file as the plant of a simulated rig."""

from __future__ import annotations

from estimator.physics.model import DrivelineModel
from estimator.signals.record import Location, OutputKind
from hil.simulator.sensed_driveline import SensedDriveline


class DrivelinePlant:
    """A driveline with its effects, stepped by the estimator's own simulation.

    Both inverters turn one shaft. This plant shares its physics with what is fitted: it is for trying things out, the
    proof has a plant of its own.

    Parameters
    ----------
    model
        The driveline, effects included.
    period_s
        Time of one step [s].
    """

    __slots__ = ("_period_s", "_stepper")

    def __init__(self, model: DrivelineModel, period_s: float) -> None:
        self._period_s = period_s
        self._stepper = SensedDriveline(model, period_s)
        self._compile()

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""
        return self._stepper.speed_rad_s

    def measured(self, kind: OutputKind, at: Location) -> float:
        """Return what a sensor there shows now [rad/s, rad, Nm, rad/s^2].

        Raises
        ------
        BadModel
            If the structure has no such output.
        """
        return self._stepper.measured(kind, at)

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the driveline run with both torques held [Nm] for one period.

        Raises
        ------
        ValueError
            If the duration is not the period this plant was made for.
        """
        if duration_s != self._period_s:
            raise ValueError(
                f"driveline: asked for a step of {duration_s:g} s, expected the {self._period_s:g} s it was made "
                "for. Make the plant with the rig's own period_s."
            )
        self._stepper.step(*torque_nm)

    def _compile(self) -> None:
        """Step once at rest, where nothing moves: the compiler must not run in the first SYNC."""
        self._stepper.step(0.0, 0.0)
