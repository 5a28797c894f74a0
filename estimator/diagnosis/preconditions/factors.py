"""Factors between units that recordings are found in, by what they make of the inertia that fits."""

from __future__ import annotations

import math

CLOSE = 1.35
"""Factor within which an inertia counts as close to a known factor: the nominal value itself may be off."""

TOO_LARGE: tuple[tuple[float, str, str], ...] = (
    (60.0 / (2.0 * math.pi), "60/(2 pi)", "is the speed in rpm, expected rad/s"),
    (180.0 / math.pi, "180/pi", "is the output in degrees, expected radians"),
    (3.6, "3.6", "is the speed in km/h, expected m/s"),
    (1000.0, "1000", "is the torque in kNm (a force in kN) or the output in thousandths (mm), expected Nm (N) and m"),
    (100.0, "100", "is the output in hundredths (cm, %), or the torque a share of 100 Nm"),
)
"""How many times too large the output over the torque is read, the factor's name, and the question to ask. What fits is
the nominal inertia divided by it."""

TOO_SMALL: tuple[tuple[float, str, str], ...] = (
    (60.0 / (2.0 * math.pi), "60/(2 pi)", "was a speed in rad/s scaled as if it were in rpm"),
    (180.0 / math.pi, "180/pi", "was an output in radians scaled as if it were in degrees"),
    (3.6, "3.6", "was a speed in m/s scaled as if it were in km/h"),
    (1000.0, "1000", "is the torque in mNm (a force in mN), or time in ms, expected Nm (N) and s"),
    (2.0 * math.pi, "2 pi", "is the speed in turns per second, expected rad/s"),
    (9.80665, "9.81", "was a force in N scaled as if it were in kp"),
)
"""The same for readings that are too small; what fits is the nominal inertia times the factor."""

AT_THE_WHEEL = "is the speed, the torque or the inertia at the wheel, expected at the motor shaft"


def known_factors(ratio: float, gear_ratio: float | None = None) -> list[str]:
    """Return what a ratio of inertias is close to, nearest first: the factor and the question to ask.

    Parameters
    ----------
    ratio : float
        Inertia that fits over the nominal one, greater than 0.
    gear_ratio : float, optional
        Motor turns per wheel turn.
    """
    table = [(1.0 / factor, f"1 / ({name})", question) for factor, name, question in TOO_LARGE]
    table += TOO_SMALL
    if gear_ratio is not None:
        for power, name in ((1, "the gear ratio"), (2, "the gear ratio squared")):
            table += [(gear_ratio**power, name, AT_THE_WHEEL), (gear_ratio**-power, f"1 / {name}", AT_THE_WHEEL)]
    distance = {row: abs(math.log(ratio / row[0])) for row in table}
    near = sorted((row for row in table if distance[row] <= math.log(CLOSE)), key=distance.__getitem__)
    return [f"{name}: {question}?" for _, name, question in near]
