"""Whether a damper does what it is for: the swing of the shaft with the loop closed, next to what it were with it open.

The design's own line, driven by the same torques less the damper's, shows the open swing; a band-pass around the
resonance, the same for both, leaves the load and the vehicle out. A loop with more dead time than it was designed for
swings by itself: more than the open one, and no less from one period to the next.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
from scipy.linalg import expm

from estimator.signals.record import FloatArray
from hil.config.damper_file import DamperFile

MORE: Final = 1.5  # times the open swing: the line may be off by some of its resonance's height
NOISE_RAD_S: Final = 0.3  # swing of a resolver's noise, many times
DECAYS: Final = 0.8  # of the period before: what decays faster is a knock from the road
PERIODS: Final = 2  # in succession


class _BandPass:
    """Second order around one frequency, a resonance's width; gain 1 there."""

    def __init__(self, frequency_hz: float, period_s: float) -> None:
        w = 2.0 * math.pi * frequency_hz * period_s
        alpha = 0.5 * math.sin(w)  # Q = 1
        self._b = alpha / (1.0 + alpha)
        self._a1, self._a2 = -2.0 * math.cos(w) / (1.0 + alpha), (1.0 - alpha) / (1.0 + alpha)
        self._before: tuple[float, float, float, float] | None = None

    def take(self, sample: float) -> float:
        """Take a sample; the first is as if it had been there for long."""
        x1, x2, y1, y2 = self._before or (sample, sample, 0.0, 0.0)
        out = self._b * (sample - x2) - self._a1 * y1 - self._a2 * y2
        self._before = sample, x1, out, y1
        return out


class SwingWatch:
    """Watches one loop, period by period of the resonance."""

    def __init__(self, file: DamperFile) -> None:
        frequency_hz = file.nominal[0].frequency_hz
        self._step, self._push = _open_line(file.line, file.period_s)
        self._state = np.zeros(3)
        self._closed, self._open = (_BandPass(frequency_hz, file.period_s) for _ in range(2))
        self._samples = max(3, round(1.0 / (frequency_hz * file.period_s)))
        self._squares = [0.0, 0.0]
        self._count = self._above = 0
        self._opens: deque[float] = deque(maxlen=4)  # a swing of the open line outlasts what made it
        self._before_rad_s = 0.0

    def take(self, torque_nm: float, speed_rad_s: float) -> str:
        """Take the torque of a cycle without the damper's, and the speed; say what is wrong, if anything is."""
        self._state = self._step @ self._state + self._push * torque_nm
        for place, swing in enumerate((self._closed.take(speed_rad_s), self._open.take(float(self._state[0])))):
            self._squares[place] += swing * swing
        self._count += 1
        if self._count < self._samples:
            return ""
        closed, opened = (math.sqrt(total / self._count) for total in self._squares)
        self._count, self._squares = 0, [0.0, 0.0]
        self._opens.append(opened)
        most = MORE * max(self._opens) + NOISE_RAD_S
        grows = closed > most and closed > DECAYS * self._before_rad_s
        self._above, self._before_rad_s = (self._above + 1 if grows else 0), closed
        if self._above < PERIODS:
            return ""
        return (
            f"the shaft swings by {closed:.2g} rad/s rms with the loop closed, expected less than the "
            f"{max(self._opens):.2g} rad/s of the open one (at most {most:.2g}): dead time or line are other than "
            "in the design"
        )


def _open_line(line: dict[str, float], period_s: float) -> tuple[FloatArray, FloatArray]:
    """Discretise the two-mass line, speeds of motor and load and twist, for a torque that is held."""
    motor, load, k, c = (line[name] for name in ("J_M", "J_L", "k", "c"))
    a = np.zeros((4, 4))
    a[0] = -(line["b_M"] + c) / motor, c / motor, -k / motor, 1.0 / motor
    a[1] = c / load, -(line["b_L"] + c) / load, k / load, 0.0
    a[2, :2] = 1.0, -1.0
    held = expm(a * period_s)
    return held[:3, :3], held[:3, 3]
