"""What a simulation of a recording begins with: its initial state, as far as unknown, and parameters."""

from __future__ import annotations

from dataclasses import dataclass

from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True)
class Start:
    """What is unknown in every recording: constant load torque [Nm] and initial state [rad, rad/s].

    Of a joint also the preload behind its gap [Nm].
    """

    load_torque_nm: float
    angle_rad: float
    speed_rad_s: float
    twist_rad: float = 0.0
    load_speed_rad_s: float = 0.0
    middle_twist_rad: float = 0.0
    middle_speed_rad_s: float = 0.0
    preload_nm: float = 0.0


@dataclass(frozen=True, slots=True)
class Case:
    """One simulation of a recording.

    Attributes
    ----------
    p : ndarray, shape (layout.SIZE,)
        Parameters of the superset model, the recording's own among them.
    extra_load_nm : ndarray, shape (N,), optional
        Load torque over time, next to the constant one.
    """

    p: FloatArray
    start: Start
    extra_load_nm: FloatArray | None = None
