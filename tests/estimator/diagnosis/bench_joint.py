"""A joint on a bench by other means than the tool's: parallel sliders that stick or slip, faces that touch or don't.

The slider is forty Jenkins elements in parallel (Iwan, J. Appl. Mech. 33, 1966) where the tool integrates the law of
Bouc and Wen; the gap's faces are found by halving.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import FloatArray, OutputKind, Record

PERIOD_S = 0.002
SAMPLES = 8000
NOISE = 80.0
ELEMENTS = 40
HALVINGS = 40


@dataclass(frozen=True, slots=True)
class Joint:
    """What a joint is made of; hardening is relative to the stiffness, ``crack`` from half of the recording on."""

    k: float = 2e5
    c: float = 3e3
    gap: float = 0.0
    friction: float = 0.0
    yields_over: float = 0.004
    hardening: float = 0.0
    crack: float = 0.0
    preload: float = 0.0
    zero_error: float = 0.0

    def nominal(self) -> DrivelineModel:
        """Return spring and damper a tenth off."""
        return DrivelineModel(Structure.JOINT, {"k": Parameter(1.1 * self.k, 0.3), "c": Parameter(1.1 * self.c, 0.5)})

    def record(self, number: int) -> Record:
        """Return one of three tests: a sine that grows, one that beats, a slow random motion."""
        twist = _motions(number)
        clean = self._torque(twist)
        output = clean + NOISE * np.random.default_rng(number).standard_normal(SAMPLES)
        okay = np.ones(SAMPLES, dtype=np.bool_)
        time_s = PERIOD_S * np.arange(float(SAMPLES))
        return Record(
            f"test_{number}", PERIOD_S, time_s, output[:, None], output, okay, OutputKind.FORCE, imposed=twist
        )

    def _torque(self, twist: FloatArray) -> FloatArray:
        limits = np.linspace(0.1, 2.0, ELEMENTS) * self.yields_over
        stretched, inside = np.zeros(ELEMENTS), 0.0
        each = self.friction / limits.sum()
        out = np.empty_like(twist)
        for i, place in enumerate(twist):
            k = self.k * (1.0 + self.crack) if i >= SAMPLES // 2 else self.k
            low, high = place - 0.5 * self.gap, place + 0.5 * self.gap

            def carried(at: float, k: float = k, since: float = inside, was: FloatArray = stretched) -> float:
                slid = np.clip(was + at - since, -limits, limits)
                return float(k * at * (1.0 + self.hardening * at**2) + each * slid.sum() - self.preload)

            if carried(low) >= 0.0:
                at, touches = low, True
            elif carried(high) <= 0.0:
                at, touches = high, True
            else:
                touches = False
                for _ in range(HALVINGS):
                    at = 0.5 * (low + high)
                    low, high = (at, high) if carried(at) < 0.0 else (low, at)
            rate = (at - inside) / PERIOD_S if i else 0.0
            out[i] = carried(at) + (self.c * rate if touches else 0.0) - self.zero_error
            stretched = np.clip(stretched + at - inside, -limits, limits)
            inside = at
        return out


def _motions(number: int) -> FloatArray:
    t = PERIOD_S * np.arange(float(SAMPLES))
    if number == 0:
        return np.asarray(0.05 * np.minimum(t / 6.0, 1.0) * np.sin(np.pi * t))
    if number == 1:
        return np.asarray(0.05 * np.sin(np.pi * t) * (0.4 + 0.6 * np.sin(0.14 * np.pi * t)))
    smooth = np.ones(400) / 400.0
    walk = np.cumsum(np.random.default_rng(9).standard_normal(SAMPLES + 800))
    walk = np.convolve(np.convolve(walk, smooth, "same"), smooth, "same")[400:-400]
    walk = walk - np.linspace(walk[0], walk[-1], SAMPLES)
    return np.asarray(0.06 * walk / np.abs(walk).max())
