"""The limits of a PLC in words, for someone who knows the vehicle to confirm, and against what its drives can do.

A register map with a torque limit ten times too high, or a speed limit in another unit, can't be seen from one reading.
Beyond `MOST_OF_RATED` times a drive's own rated value a limit limits nothing, and is refused: a traction drive gives
two to three times its rated torque for a short time, and its field weakening ends at about three times its base speed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from drivers.errors import ConfigMismatch
from drivers.inverter.inverter import Inverter
from drivers.plc.types import PlcStatus
from hil.config.rig_file import Rig

MOST_OF_RATED: Final = 3.0
"""A limit of the PLC beyond so many times the drives' rated value is refused."""

MAX_MOTOR_SPEED: Final = (0x6080, 0)
"""Of CiA 402 [rpm]; few drives have it."""

RPM: Final = 2.0 * math.pi / 60.0


@dataclass(frozen=True, slots=True)
class PlcLimit:
    """One limit that the PLC reports.

    Attributes
    ----------
    what
        Its name.
    question
        It and what it is to be compared with, in words.
    found, most
        It, and the largest that is believed, with their unit; ``most`` is None where the drives say nothing of it.
    believed
        Whether it is within that.
    """

    what: str
    question: str
    found: str
    most: str | None
    believed: bool


def max_speed_rad_s(inverter: Inverter) -> float | None:
    """Read a drive's own largest speed [rad/s]; None where it has none."""
    with suppress(ConfigMismatch):
        return inverter.read_channel(MAX_MOTOR_SPEED) * RPM or None
    return None


def plc_limits(status: PlcStatus, rig: Rig, drives_rad_s: float | None) -> Iterator[PlcLimit]:
    """Put each limit into words."""
    tables = (rig.inverters.m1, rig.inverters.m2)
    rated_nm = max(table.rated_torque_nm for table in tables)
    asked_nm = max(table.torque_limit_nm for table in tables)
    yield PlcLimit(
        "torque limit",
        f"the PLC allows {status.torque_limit_nm:,g} Nm of one inverter; the drives are rated {rated_nm:,g} Nm, the "
        f"rig file asks for {asked_nm:,g} Nm at most: right?",
        f"{status.torque_limit_nm:,g} Nm",
        f"{MOST_OF_RATED * rated_nm:,g} Nm, {MOST_OF_RATED:g} times rated torque",
        status.torque_limit_nm <= MOST_OF_RATED * rated_nm,
    )
    own = {"the drives": drives_rad_s, "the rig file": rig.guard.speed_limit_rad_s}
    known = {who: limit for who, limit in own.items() if limit is not None}
    others = "".join(f"; {who} {_speed(limit)}" for who, limit in known.items())
    most = MOST_OF_RATED * min(known.values()) if known else None
    yield PlcLimit(
        "speed limit",
        f"the PLC allows {_speed(status.speed_limit_rad_s)} of the motor shaft{others}: right?",
        _speed(status.speed_limit_rad_s),
        None if most is None else f"{_speed(most)}, {MOST_OF_RATED:g} times the drives' or the rig file's own",
        most is None or status.speed_limit_rad_s <= most,
    )


def _speed(rad_s: float) -> str:
    return f"{rad_s:,.4g} rad/s ({rad_s / RPM:,.0f} rpm)"
