"""What the extended Kalman filter takes for noise, and how far it trusts where it starts."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from estimator.identification.online.two_mass import TwoMass
from estimator.signals.record import FloatArray
from estimator.signals.settings import Requirement, is_positive, require


@dataclass(frozen=True, slots=True)
class EkfNoise:
    """Standard deviations; the defaults are those of a bus on an ordinary road, about twice what its sensors have.

    Twice, since what wrong start values do to the linearisation counts as noise too. With the sensors' own 0.05 rad/s
    and 1 Nm, and starts 30 to 70 % off, one or two of twelve simulated cruises of 30 s ended with a load inertia twice
    to a hundred times too large, and believed it.

    Attributes
    ----------
    output_rad_s : float
        Noise of a speed reading [rad/s].
    torque_nm : float
        What of the motor's torque in a sample the reading does not tell [Nm]: resolution, ripple.
    load_nm_per_sqrt_s : float
        How far the load torque wanders in a second [Nm].
    log_per_sqrt_s : float
        How far a parameter wanders in a second, relative to itself.
    start_log : float
        How far a start value may be off, relative to itself: 0.7 is a factor of two.
    start_speed_rad_s, start_twist_rad, start_load_nm : float
        The same of the motion: speed difference [rad/s], twist [rad], load torque [Nm].

    Raises
    ------
    BadSetting
        If one is not above 0.
    """

    output_rad_s: float = 0.1
    torque_nm: float = 10.0
    load_nm_per_sqrt_s: float = 10.0
    log_per_sqrt_s: float = 1e-4
    start_log: float = 0.7
    start_speed_rad_s: float = 1.0
    start_twist_rad: float = 0.2
    start_load_nm: float = 1000.0

    def __post_init__(self) -> None:
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        require("ekf noise", [Requirement(name, v, is_positive(v), "above 0") for name, v in values.items()])

    def law(self, start: TwoMass, period_s: float) -> FloatArray:
        """Return the settings in the order of ``ekf_kernel``: period, R, diag Q, diag P(0), x(0); shape (26,)."""
        speed = (period_s * self.torque_nm / start.J_M) ** 2
        load = period_s * self.load_nm_per_sqrt_s**2
        # T_0 wandering within the period has moved w_L by its integral: the variance of a random walk's integral.
        load_speed = load * (period_s / start.J_L) ** 2 / 3.0
        walk = period_s * self.log_per_sqrt_s**2
        noise = [speed, load_speed, 0.0, load, walk, walk, walk, walk]
        motion = [self.start_speed_rad_s**2, self.start_speed_rad_s**2, self.start_twist_rad**2, self.start_load_nm**2]
        origin = [0.0, 0.0, 0.0, 0.0, *np.log([start.J_M, start.J_L, start.k, start.c])]
        return np.array([period_s, self.output_rad_s**2, *noise, *motion, *[self.start_log**2] * 4, *origin])
