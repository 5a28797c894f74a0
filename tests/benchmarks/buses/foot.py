"""The driver's foot: a slow controller of the speed that reacts late. With it the torque follows the speed."""

from __future__ import annotations

from collections import deque

from tests.benchmarks.buses.bus import Bus


class Foot:
    """Proportional and integral action on the speed read a reaction time ago, through foot and pedal.

    The load alone, ``1 / J s`` with all inertia, is what the driver feels: the gain is crossover times inertia, and
    the integral has a tenth of the crossover's speed. Two lags, of the reading and of the pedal, keep the foot off the
    resonance, where the speed of the motor answers a torque much more than ``1 / J s`` says.

    Parameters
    ----------
    bus
        Whose speed is held.
    torque_nm
        That holds it without road [Nm].
    period_s
        Between two calls [s].
    """

    def __init__(self, bus: Bus, torque_nm: float, period_s: float) -> None:
        driver, inertia = bus.driver, bus.line.J_M + bus.line.J_L
        self._gain = driver.bandwidth_rad_s * inertia
        self._integral_gain = self._gain * driver.bandwidth_rad_s / 10.0 * period_s
        self._reading_share = period_s / (driver.reading_s + period_s)
        self._pedal_share = period_s / (driver.pedal_s + period_s)
        self._target = self._shown = bus.speed_rad_s
        self._seen = deque([bus.speed_rad_s] * max(round(driver.reaction_s / period_s), 1))
        self._held_nm = self._pedal_nm = torque_nm

    def torque_nm(self, speed_rad_s: float) -> float:
        """Return the torque that is asked for after one more reading of the speed [Nm]."""
        self._shown += self._reading_share * (speed_rad_s - self._shown)
        self._seen.append(self._shown)
        short = self._target - self._seen.popleft()
        self._held_nm += self._integral_gain * short
        self._pedal_nm += self._pedal_share * (self._held_nm + self._gain * short - self._pedal_nm)
        return self._pedal_nm
