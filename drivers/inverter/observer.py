"""What drives and vehicle must do: the torque of a drive by its own response, the speed by inertia and load.

A drive's torque follows its command through its slope and within its response time, and may be sampled up to
`SAMPLED_CYCLES` late; an answer that may be to an older SYNC reaches back so many cycles more, and that answer only.

The vehicle is one inertia against an unknown load: speed' = gain torque / inertia - load. A Kalman filter follows
speed, load and gain, the load as a random walk whose steps grow with the way driven, for a grade lies in the road.
Torque and speed pass the same low-pass filter, which leaves the equation as it is and the swings of the shaft outside.

No clock or bus here, and nothing is judged: predictions with their uncertainty, one step per cycle.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.inverter.vehicle import GRAVITY_M_S2, ROLLING_RAD_S2, Vehicle

FloatArray = npt.NDArray[np.float64]

SAMPLED_CYCLES: Final = 2
"""A drive may take its command, and sample its torque, each a cycle later than another."""

IDENTITY: Final = np.eye(4)
SPEED_AND_LOAD: Final = np.array([1.0, 1.0, 0.0, 0.0])  # what is learnt where friction or the shaft may turn

SWING_S: Final = 0.15
"""Each of two low-pass filters in series [s]: a swing of 5 Hz is left at 1/23, one of 8 Hz at 1/58."""

TWIST_S2: Final = 0.03
"""Inertia over stiffness: while a torque changes its shaft twists, and the motor is ahead of the vehicle by this times
the rate of the torque's acceleration; 0.024 of the example's bus, as uncertain as it is long."""

TIMING_S: Final = 0.01  # by so much torque and speed may be sampled apart [s]

BLOCK_S: Final = 0.1  # time between two steps of the vehicle's filter [s]
GRADE_PER_ROOT_M: Final = 0.004  # how far a grade goes from what it was, over the root of the way [1/m^0.5]
WIND_RAD_S2: Final = 0.15  # how far the rest of the load goes in a second [rad/s²]
GAIN_WALK: Final = 0.02  # how far the gain goes in a second
STILL_RAD_S: Final = 0.15  # ten times the noise of a resolver's low-passed speed: nearer to zero a vehicle may stand
WINDOW_RAD_S: Final = 0.3  # so slow a motor may be that its drive shows to stand

UNWINDS_S: Final = 0.6
"""After a turn of the torque the shaft unwinds and winds up again: the motor's speed is not the vehicle's for so long,
two time constants of the filter included."""

GAP_RAD: Final = 0.05  # that a shaft may go through without a torque, there and back

SLOW_RAD_S: Final = 0.5  # nearer to zero dry friction may turn at any time, so that a torque's gain is not to be had


class TorquePrediction:
    """The torque that one drive must give, as a range."""

    __slots__ = ("_lagged_nm", "_left", "_ramp_nm", "_ranges", "_slope_nm", "commanded_nm")

    def __init__(self, period_s: float, response_s: float, slope_nm_per_s: float | None, most_late: int) -> None:
        self._ranges: deque[tuple[float, float]] = deque(maxlen=1 + SAMPLED_CYCLES + most_late)
        self._slope_nm = math.inf if slope_nm_per_s is None else slope_nm_per_s * period_s
        # 5 % is left after the response time; one of a period is over by the next SYNC
        self._left = math.exp(-3.0 * period_s / response_s) if response_s > period_s else 0.0
        self._ramp_nm = self._lagged_nm = self.commanded_nm = 0.0

    def command(self, target_nm: float, offset_nm: float) -> None:
        """Take the command of a cycle; the slope holds the target torque alone."""
        step_nm = target_nm - self._ramp_nm
        self._ramp_nm += min(max(step_nm, -self._slope_nm), self._slope_nm)
        given_nm = self._ramp_nm + offset_nm
        self._lagged_nm = lagged_nm = given_nm + self._left * (self._lagged_nm - given_nm)
        self.commanded_nm = target_nm + offset_nm
        self._ranges.append((given_nm, lagged_nm) if given_nm < lagged_nm else (lagged_nm, given_nm))

    def range(self, late_cycles: int = 0) -> tuple[float, float]:
        """Give the least and greatest torque of an answer to one of so many more SYNCs than the last [Nm]."""
        ranges = self._ranges
        if late_cycles == 0 and len(ranges) > SAMPLED_CYCLES:  # as in nearly every cycle
            (low, high), (low_1, high_1), (low_2, high_2) = ranges[-1], ranges[-2], ranges[-3]
            return min(low, low_1, low_2), max(high, high_1, high_2)
        first = max(0, len(ranges) - 1 - SAMPLED_CYCLES - late_cycles)
        recent = [ranges[at] for at in range(first, len(ranges))]
        return min(low for low, _ in recent), max(high for _, high in recent)


class LowPass:
    """Two first-order filters in series, for samples that may be missing."""

    __slots__ = ("_first", "_left", "value")

    def __init__(self, period_s: float) -> None:
        self._left = math.exp(-period_s / SWING_S)
        self._first = self.value = math.nan

    def take(self, sample: float, cycles: int = 1) -> float:
        """Take a sample that stands for so many cycles; the first is taken as it is."""
        if math.isnan(self.value):
            self._first = self.value = sample
            return sample
        left = self._left if cycles == 1 else self._left**cycles
        self._first = first = sample + left * (self._first - sample)
        self.value = value = first + left * (self.value - first)
        return value

    @property
    def rate_per_s(self) -> float:
        """Change of the value per second at the last sample."""
        return (self._first - self.value) / SWING_S


class Motion(NamedTuple):
    """The vehicle as estimated at the end of one block."""

    speed_rad_s: float  # as read, low-passed
    predicted_rad_s: float  # from the blocks before
    deviation_rad_s: float  # of the difference of both
    gain: float  # acceleration per torque, in multiples of what the usual inertia has
    gain_deviation: float  # standard deviation of the gain
    load_rad_s2: float  # deceleration by grade, wind and rolling
    load_deviation_rad_s2: float  # standard deviation of the load
    held_rad_s: float  # speed that a standing vehicle should have got by now, at least
    surprise: float  # Page's sum of the differences of one sign, each over its deviation and less 1


class VehicleObserver:
    """Follows one vehicle: speed, load, gain and twist by a Kalman filter of a step per block."""

    def __init__(self, vehicle: Vehicle, period_s: float) -> None:
        self._vehicle = vehicle
        self._period_s = period_s
        self._cycles = max(1, round(BLOCK_S / period_s))
        self._torque = LowPass(period_s)
        self._count = 0
        self._swing = self._pushed = self._last_u = 0.0
        self._reading_rad_s = math.nan
        self._last_nm = 0.0
        self._since_turn_s = math.inf
        self._released_rad = 0.0
        self._changed = True
        self._jump_rad_s = 0.0  # last change of the reading
        self._direction = 0.0
        self._begun_s = 0.0
        self._unknown_rad_s2 = 0.25 * vehicle.most_load_rad_s2
        low, high = vehicle.gains
        self._x = np.array([math.nan, 0.0, 0.5 * (low + high), TWIST_S2])
        self._p = np.diag([0.01, self._unknown_rad_s2**2, (0.5 * (high - low)) ** 2, TWIST_S2**2])
        self._held_rad_s = self._stands_s = 0.0
        self._last_free = (0.0, 0.0, 0.0)  # torque, acceleration and its variance when it last moved
        self._surprise = (0.0, 0.0)

    def take(self, torque_nm: float, speed_rad_s: float, reading_rad_s: float, cycles: int) -> Motion | None:
        """Take the torque of both drives, the low-passed speed, and the last reading; give the motion once a block."""
        self._look_for_turn(torque_nm, cycles)
        u = self._torque.take(torque_nm, cycles) / self._vehicle.inertia_kg_m2
        self._pushed += 0.5 * cycles * (u + self._last_u)
        self._last_u = u
        self._swing += cycles * (reading_rad_s - speed_rad_s) ** 2
        if reading_rad_s != self._reading_rad_s:
            self._jump_rad_s = 0.0 if math.isnan(self._reading_rad_s) else reading_rad_s - self._reading_rad_s
            self._changed, self._reading_rad_s = True, reading_rad_s
        self._count += cycles
        if self._count < self._cycles:
            return None
        dt_s, u, swing_rad_s = (
            self._count * self._period_s,
            self._pushed / self._count,
            math.sqrt(self._swing / self._count),
        )
        rate = self._torque.rate_per_s / self._vehicle.inertia_kg_m2
        motion = self._step(dt_s, u, rate, speed_rad_s, 0.03 + 0.05 * swing_rad_s + TIMING_S * abs(rate) * dt_s)
        self._count, self._swing, self._pushed, self._changed = 0, 0.0, 0.0, False
        return motion

    def _look_for_turn(self, torque_nm: float, cycles: int) -> None:
        """See whether the torque has changed its sign, and how far the shaft may unwind by it."""
        self._since_turn_s += cycles * self._period_s
        if torque_nm * self._last_nm < 0.0:
            before_rad = self._released_rad if self._since_turn_s < UNWINDS_S else 0.0
            released_rad = GAP_RAD + TWIST_S2 * abs(torque_nm - self._last_nm) / self._vehicle.inertia_kg_m2
            self._since_turn_s, self._released_rad = 0.0, max(before_rad, released_rad)
        self._last_nm = torque_nm or self._last_nm

    def _step(self, dt_s: float, u: float, rate: float, speed_rad_s: float, noise_rad_s: float) -> Motion:
        if math.isnan(self._x[0]):
            self._x[0] = speed_rad_s
        before = float(self._x[0])
        stands = max(abs(speed_rad_s), abs(before)) < STILL_RAD_S or not self._changed
        self._spread(dt_s, u)
        self._begun_s += dt_s
        if self._begun_s < UNWINDS_S:  # a vehicle released on a grade: its load comes through the low-pass by and by
            self._p[1, 1] += self._unknown_rad_s2**2 * dt_s / UNWINDS_S
        if not stands:
            self._walk(dt_s, abs(speed_rad_s), turned=speed_rad_s * before < 0.0)
        slow, unwinds = abs(speed_rad_s) < SLOW_RAD_S, self._since_turn_s < UNWINDS_S
        x, h = self._x, np.array([1.0, 0.0, 0.0, rate])
        predicted = float(h @ x)
        noise_rad_s = math.hypot(
            noise_rad_s,
            slow * ROLLING_RAD_S2 * dt_s,  # dry friction may have turned
            unwinds * self._released_rad / (2.0 * SWING_S),
        )
        k = self._p @ h
        s = float(h @ k) + noise_rad_s**2
        if stands:
            self._stand(dt_s, u, speed_rad_s, noise_rad_s)
        else:
            self._held_rad_s, self._stands_s, self._direction = 0.0, 0.0, math.copysign(1.0, speed_rad_s)
            off = speed_rad_s - predicted
            self._learn(k * SPEED_AND_LOAD if slow or unwinds else k, h, off, s)
            deviations, (faster, slower) = off / math.sqrt(s), self._surprise
            self._surprise = max(0.0, faster + deviations - 1.0), max(0.0, slower - deviations - 1.0)
        (_, load, gain, _), (_, load_std, gain_std, _) = self._x.tolist(), np.sqrt(self._p.diagonal()).tolist()
        return Motion(
            speed_rad_s, predicted, math.sqrt(s), gain, gain_std, load, load_std, self._held_rad_s, max(self._surprise)
        )

    def _learn(self, k: FloatArray, h: FloatArray, off: float, s: float) -> None:
        """Take a speed; where ``k`` has been cut, by Joseph's form of the update."""
        left = IDENTITY - np.outer(k, h) / s
        noise = s - float(h @ self._p @ h)
        self._x = self._x + k / s * off
        self._p = left @ self._p @ left.T + np.outer(k, k) * (noise / s**2)

    def _spread(self, dt_s: float, u: float) -> None:
        """Carry state and covariance over a block."""
        x, p, pushed = self._x, self._p, u * dt_s
        x[0] += pushed * x[2] - dt_s * x[1]
        p[0] += pushed * p[2] - dt_s * p[1]
        p[:, 0] += pushed * p[:, 2] - dt_s * p[:, 1]
        p[2, 2] += GAIN_WALK**2 * dt_s

    def _walk(self, dt_s: float, speed_rad_s: float, turned: bool) -> None:
        """Let the load go as far as it may in a block, on the way driven and by the wind."""
        travel_m = self._vehicle.travel_m_per_rad
        walk = WIND_RAD_S2**2 + (GRAVITY_M_S2 * GRADE_PER_ROOT_M) ** 2 / travel_m * speed_rad_s
        self._p[0, 0] += walk * dt_s**3 / 3.0
        self._p[0, 1] -= walk * dt_s**2 / 2.0
        self._p[1, 0] = self._p[0, 1]
        self._p[1, 1] += walk * dt_s + (ROLLING_RAD_S2**2 if turned else 0.0)  # friction changes its sign

    def _stand(self, dt_s: float, u: float, speed_rad_s: float, noise_rad_s: float) -> None:
        """Take a speed near zero, or one that stands to the last bit: a dead reading, or a drive at rest."""
        load, load_std = float(self._x[1]), math.sqrt(self._p[1, 1])
        if self._changed:  # the reading lives, so the vehicle stands: friction holds it, and a load like its torque
            low, high = sorted(gain * u for gain in self._vehicle.gains)
            load = min(max(load, low - ROLLING_RAD_S2), high + ROLLING_RAD_S2)
            load_std, self._held_rad_s, self._stands_s = max(load_std, ROLLING_RAD_S2), 0.0, 0.0
        else:
            self._hold(dt_s, u)
            noise_rad_s = math.hypot(noise_rad_s, WINDOW_RAD_S)
        self._x[:2] = speed_rad_s, load
        self._p[:2, :], self._p[:, :2] = 0.0, 0.0
        self._p[0, 0], self._p[1, 1] = noise_rad_s**2, load_std**2

    def _hold(self, dt_s: float, u: float) -> None:
        """Sum up by how much the speed should have changed since it stands, at least: its last jump, and by torque."""
        gain = float(self._x[2])
        if not self._stands_s:
            self._held_rad_s = -self._jump_rad_s
            net = np.array([0.0, -1.0, u, 0.0])  # the errors of gain and load are correlated
            self._last_free = u, float(net @ self._x), float(net @ self._p @ net)
        self._stands_s += dt_s
        free_u, free, variance = self._last_free
        free += gain * (u - free_u)
        push = math.copysign(1.0, free)
        speeds_up = push * self._vehicle.gains[0] * u - ROLLING_RAD_S2  # with no load but friction
        if self._direction:  # within what it did before it stood
            turns = 2.0 * ROLLING_RAD_S2 if push * self._direction < 0.0 else 0.0  # friction: it was in the load
            spread = 3.0 * math.sqrt(variance + self._p[2, 2] * (u - free_u) ** 2 + WIND_RAD_S2**2)
            speeds_up = min(max(speeds_up, abs(free) - turns - spread), abs(free) - turns + spread)
        self._held_rad_s += push * max(speeds_up, 0.0) * dt_s
