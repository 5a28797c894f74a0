"""Factors between units that recordings are found in, by what they make of the inertia that fits."""

from __future__ import annotations

import math
from dataclasses import dataclass

CLOSE = 1.35
"""Factor within which an inertia counts as close to a known factor: the nominal value itself may be off."""


@dataclass(frozen=True, slots=True)
class Factor:
    """A factor between units.

    Attributes
    ----------
    ratio : float
        Inertia that fits over the nominal one.
    name, question : str
        The factor, and what to ask.
    output, torque : float
        What the output, or the torque, is to be multiplied by.
    """

    ratio: float
    name: str
    question: str
    output: float = 1.0
    torque: float = 1.0

    @property
    def said(self) -> str:
        """The factor and the question, for people."""
        return f"{self.name}: {self.question}?"


def _too_large(factor: float, name: str, question: str, torque: bool = False) -> Factor:
    """Return a factor by which the output over the torque is read too large."""
    cure = {"torque": factor} if torque else {"output": 1.0 / factor}
    return Factor(1.0 / factor, f"1 / ({name})", question, **cure)


def _too_small(factor: float, name: str, question: str, torque: bool = False) -> Factor:
    """Return a factor by which it is read too small."""
    cure = {"torque": 1.0 / factor} if torque else {"output": factor}
    return Factor(factor, name, question, **cure)


KNOWN: tuple[Factor, ...] = (
    _too_large(60.0 / (2.0 * math.pi), "60/(2 pi)", "is the speed in rpm, expected rad/s"),
    _too_large(180.0 / math.pi, "180/pi", "is the output in degrees, expected radians"),
    _too_large(3.6, "3.6", "is the speed in km/h, expected m/s"),
    _too_large(
        1000.0,
        "1000",
        "is the torque in kNm (a force in kN) or the output in thousandths (mm), expected Nm (N) and m",
        torque=True,
    ),
    _too_large(100.0, "100", "is the output in hundredths (cm, %), or the torque a share of 100 Nm"),
    _too_small(60.0 / (2.0 * math.pi), "60/(2 pi)", "was a speed in rad/s scaled as if it were in rpm"),
    _too_small(180.0 / math.pi, "180/pi", "was an output in radians scaled as if it were in degrees"),
    _too_small(3.6, "3.6", "was a speed in m/s scaled as if it were in km/h"),
    _too_small(
        1000.0, "1000", "is the torque in mNm (a force in mN), or time in ms, expected Nm (N) and s", torque=True
    ),
    _too_small(2.0 * math.pi, "2 pi", "is the speed in turns per second, expected rad/s"),
    _too_small(9.80665, "9.81", "was a force in N scaled as if it were in kp", torque=True),
)

AT_THE_WHEEL = "is the speed, the torque or the inertia at the wheel, expected at the motor shaft"


def close_factors(ratio: float, gear_ratio: float | None = None) -> list[Factor]:
    """Return the factors that a ratio of inertias is close to, nearest first.

    Parameters
    ----------
    ratio : float
        Inertia that fits over the nominal one, greater than 0.
    gear_ratio : float, optional
        Motor turns per wheel turn.
    """
    table = list(KNOWN)
    if gear_ratio is not None:
        for power, name in ((1, "the gear ratio"), (2, "the gear ratio squared")):
            table.append(Factor(gear_ratio**power, name, AT_THE_WHEEL))
            table.append(Factor(gear_ratio**-power, f"1 / {name}", AT_THE_WHEEL))
    distance = {row: abs(math.log(ratio / row.ratio)) for row in table}
    return sorted((row for row in table if distance[row] <= math.log(CLOSE)), key=distance.__getitem__)
