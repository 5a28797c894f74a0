"""Courses of torque for a standing vehicle: pulses that bring it back to where it was, and none at all."""

from __future__ import annotations

LEAD_S = 1.0
"""Zero torque before the first pulse and after the last [s]: what the readings show without one."""

WAVE_STEPS = 4
"""Steps in one wave of pulses; see `Pulses`."""


class Pulses:
    """Waves of +1, -1, -1, +1 steps of torque: speed and place return to where they were after each."""

    __slots__ = ("_duration_s", "_step_nm", "_step_s", "waves")

    def __init__(self, step_nm: float, step_s: float, duration_s: float) -> None:
        self._step_nm = step_nm
        self._step_s = step_s
        self._duration_s = duration_s
        self.waves = max(0, int((duration_s - 2.0 * LEAD_S) / (WAVE_STEPS * step_s) + 1e-9))

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return self._duration_s

    def torque_nm(self, time_s: float) -> float:
        """Torque at a time [Nm]."""
        step = int((time_s - LEAD_S) / self._step_s + 1e-9)
        if time_s < LEAD_S - 1e-9 or step >= self.waves * WAVE_STEPS:
            return 0.0
        return self._step_nm if step % WAVE_STEPS in (0, WAVE_STEPS - 1) else -self._step_nm


class Rest:
    """No torque."""

    __slots__ = ("_duration_s",)

    def __init__(self, duration_s: float) -> None:
        self._duration_s = duration_s

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return self._duration_s

    def torque_nm(self, time_s: float) -> float:
        """Zero [Nm]."""
        return 0.0
