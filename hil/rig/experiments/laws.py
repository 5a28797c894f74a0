"""The torque that makes each kind of experiment: laws for a vehicle at a start speed, courses for one that stands."""

from __future__ import annotations

from dataclasses import dataclass, field

from hil.rig.experiments.staged import HoldTuning, LowPass, SpeedHold

BANDWIDTH_HZ = 0.01
"""Crossover of a cruise's speed loop while measuring [Hz].

The lowest frequency of interest is 0.3 Hz (where the estimators' high-pass begins): 30 times above the
crossover, and the loop's low-pass (at five times the crossover, see `HoldTuning`) leaves it 1/30 * 1/6 =
0.6 % of the vehicle's own response there.
"""

TURNING_FILTER_S = 0.1
"""Low-pass of the speed that decides on turning [s]: a resonance at 8 Hz is a fifth of itself behind it."""

LEAD_S = 1.0
"""Zero torque before the first pulse and after the last [s]: what the readings show without one."""

WAVE_STEPS = 4
"""Steps in one wave of pulses; see `Pulses`."""


class Cruise:
    """Hold a speed, so slowly that the loop does not shape the response to the PRBS: the paper's own test."""

    def __init__(
        self, speed_rad_s: float, duration_s: float, inertia_kg_m2: float, torque_limit_nm: float, period_s: float
    ) -> None:
        self.start_speed_rad_s = speed_rad_s
        self.duration_s = duration_s
        tuning = HoldTuning.for_bandwidth(BANDWIDTH_HZ, inertia_kg_m2)
        self._hold = SpeedHold(speed_rad_s, tuning, torque_limit_nm, period_s)

    def begin(self, torque_nm: float) -> None:
        """Take over at the torque that holds the start speed [Nm]: the integral starts there."""
        self._hold.start_from(torque_nm)

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Return the torque of the speed loop [Nm]; the time does not matter to it."""
        return self._hold.torque_nm(speed_rad_s)


@dataclass(slots=True)
class Coast:
    """No torque from a speed on: what slows the vehicle is its own."""

    start_speed_rad_s: float  # that the approach leads up to
    duration_s: float  # of the measured part
    hold_nm: float = field(default=0.0, init=False)  # what held the start speed

    def begin(self, torque_nm: float) -> None:
        """Keep the torque that holds the start speed [Nm]."""
        self.hold_nm = torque_nm

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Return zero [Nm], at every time and speed."""
        return 0.0


@dataclass(slots=True)
class Tip(Coast):
    """Steps of torque about what holds the speed, as a driver's foot makes them: up for one, down for the next.

    A step larger than the holding torque takes the driveline through zero torque, where backlash lies.
    """

    step_nm: float  # up or down from `hold_nm`, both inverters together
    step_s: float  # length of each step but the first, which is half as long

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque of the step that runs now [Nm]; the first half step is up, so that the mean speed stays."""
        steps_begun = int(time_s / self.step_s + 0.5)
        return self.hold_nm + (self.step_nm if steps_begun % 2 == 0 else -self.step_nm)


@dataclass(slots=True)
class Ramp(Coast):
    """Torque that rises and falls evenly about what keeps the vehicle in its place, through zero."""

    swing_nm: float  # largest torque either way
    ramp_s: float  # time from the middle to it

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque of the triangle [Nm]: up, down through zero, and back, in four ramps."""
        quarter = (time_s / self.ramp_s) % 4.0
        share = quarter if quarter < 1.0 else 2.0 - quarter if quarter < 3.0 else quarter - 4.0
        return self.hold_nm + self.swing_nm * share


@dataclass(slots=True)
class Reversal(Coast):
    """Constant torque one way until the speed is reached, then the other way: shows dry friction and backlash.

    Turning at a speed rather than at a time keeps the vehicle near its place on a grade, and makes the
    speed cross zero in every half period whatever the inertia is.
    """

    turning_speed_rad_s: float  # low-passed speed, either way, at which the torque turns
    swing_nm: float  # torque either way about `hold_nm`
    period_s: float  # of the torque cycle, not of the swing
    _speed: LowPass = field(init=False)  # by `TURNING_FILTER_S`
    _direction: float = field(default=1.0, init=False)  # 1 or -1

    def __post_init__(self) -> None:
        self._speed = LowPass(TURNING_FILTER_S, self.period_s)

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque towards the turning speed [Nm]."""
        if self._direction * self._speed.update(speed_rad_s) >= self.turning_speed_rad_s:
            self._direction = -self._direction
        return self.hold_nm + self._direction * self.swing_nm


@dataclass(frozen=True, slots=True)
class Rest:
    """No torque, of a vehicle that stands."""

    duration_s: float  # of the measured part

    def torque_nm(self, time_s: float) -> float:
        """Return zero [Nm], at every time."""
        return 0.0


@dataclass(frozen=True, slots=True)
class Pulses(Rest):
    """Waves of +1, -1, -1, +1 steps of torque: speed and place return to where they were after each."""

    step_nm: float  # height of a step, both inverters together
    step_s: float  # length of each of a wave's steps

    def torque_nm(self, time_s: float) -> float:
        """Return the torque of the step that runs at a time [Nm]; zero before the first wave and after the last."""
        waves = max(0, int((self.duration_s - 2.0 * LEAD_S) / (WAVE_STEPS * self.step_s) + 1e-9))
        step = int((time_s - LEAD_S) / self.step_s + 1e-9)
        if time_s < LEAD_S - 1e-9 or step >= waves * WAVE_STEPS:
            return 0.0
        return self.step_nm if step % WAVE_STEPS in (0, WAVE_STEPS - 1) else -self.step_nm
