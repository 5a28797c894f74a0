"""What a simulated drive reads of itself: torque, current and speed, with noise, in counts.

Current is what makes the torque; above the base speed a part of it weakens the field, so that it is more.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivers.scaling import IntegerType, VelocityScale
from hil.simulator.inverter_settings import SimulatedInverter
from hil.simulator.sample_clock import SampleClock

_INT16 = IntegerType.INTEGER16

DRAWN_AT_ONCE = 512


def _normal(random: np.random.Generator) -> Iterator[float]:
    """Draw standard normal numbers for ever.

    Many at once: for every array it fills numpy gives the interpreter lock away and takes it back, and a thread that
    waits for the lock would hardly ever get it (see ``estimator.compiled.brief``).
    """
    while True:
        yield from random.standard_normal(DRAWN_AT_ONCE).tolist()


class DriveSensors:
    """The latest readings of one drive.

    Parameters
    ----------
    settings
        Noise, coarseness, and whether it samples at SYNC.
    velocity
        Scale of the velocity actual value.
    seed
        Of the noise.

    Attributes
    ----------
    torque, current
        Torque and current actual value, 0x6077 and 0x6078 [per mille of rated].
    speed
        Velocity actual value, 0x606C [counts].
    """

    __slots__ = ("_clock", "_noise", "_settings", "_velocity_scale", "current", "speed", "torque")

    def __init__(self, settings: SimulatedInverter, velocity: VelocityScale, seed: int) -> None:
        self._settings = settings
        self._noise = _normal(np.random.default_rng([seed, settings.node_id]))
        self._velocity_scale = velocity
        self._clock = SampleClock(settings.faults.clock_drift_ppm)
        self.clear()

    def clear(self) -> None:
        """Read nothing yet, as at power-on."""
        self.torque = self.current = self.speed = 0

    def sample(self, true_speed_rad_s: float, torque_permille: float) -> None:
        """Read the machine at this SYNC.

        Parameters
        ----------
        true_speed_rad_s
            Motor speed [rad/s].
        torque_permille
            Torque in effect [per mille of rated].
        """
        speed_rad_s, torque = self._clock.sample(true_speed_rad_s, torque_permille)
        torque_noise, speed_noise = next(self._noise), next(self._noise)
        torque += self._settings.torque_noise_counts * torque_noise
        self.torque = self._converted(torque)
        self.current = self._converted(torque / self._settings.faults.limits.weakening(true_speed_rad_s))
        speed_rad_s += self._settings.speed_noise_rad_s * speed_noise
        self.speed = self._velocity_scale.to_raw(speed_rad_s, "simulated resolver")

    def _converted(self, permille: float) -> int:
        """Read as a converter does: in steps, and saturating."""
        return min(max(self._settings.faults.limits.quantised(permille), _INT16.low), _INT16.high)
