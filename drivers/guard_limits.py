"""The limits of the torque guard: of what is asked for, and of what comes back from the drives."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final

from drivers.errors import ConfigMismatch

NS_PER_S: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class ErrorLimits:
    """How far the torque a drive reports may be from the one it was commanded; see `drivers.inverter.supervision`."""

    m1_nm: float  # of inverter m1: torque_error_nm [Nm]
    m2_nm: float  # of inverter m2 [Nm]
    sum_nm: float  # of both together, sign counted [Nm]
    time_s: float  # so long in all a torque may be further off [s]
    response_s: float  # time in which a drive follows a change of its command [s]

    def __post_init__(self) -> None:
        _require_limits("torque error", {field.name: getattr(self, field.name) for field in fields(self)})


@dataclass(frozen=True, slots=True)
class GuardLimits:
    """The limits of one rig; there are no defaults.

    Attributes
    ----------
    torque_limit_m1_nm, torque_limit_m2_nm : float
        Largest magnitude of base + PRBS torque of each inverter [Nm].
    prbs_limit_nm : float
        Largest magnitude of the PRBS part of one inverter [Nm]; its steps are at most twice this.
    rate_limit_nm_per_s : float
        Fastest change of the base torque of one inverter [Nm/s].
    sum_limit_nm : float
        Largest magnitude of the sum of both inverters, sign counted [Nm].
    feedback_timeout_s : float
        Oldest feedback a torque may be built on [s].
    permissive_timeout_s : float
        Oldest permission of the PLC a torque may be built on [s].
    speed_limit_rad_s : float
        Fastest motor speed at which there may be a torque [rad/s]; infinite where the PLC alone limits it.
    period_s : float
        Time between two requests; a longer one allows no larger change [s].
    error : ErrorLimits
        Of the torques that come back.

    Raises
    ------
    ConfigMismatch
        If a limit is not a finite number above zero; names all that are not.
    """

    torque_limit_m1_nm: float  # largest absolute torque of inverter m1 [Nm]
    torque_limit_m2_nm: float  # ... of inverter m2 [Nm]
    prbs_limit_nm: float
    rate_limit_nm_per_s: float
    sum_limit_nm: float
    feedback_timeout_s: float
    permissive_timeout_s: float
    speed_limit_rad_s: float
    period_s: float
    error: ErrorLimits

    def __post_init__(self) -> None:
        values = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "error"}
        if values["speed_limit_rad_s"] == math.inf:
            del values["speed_limit_rad_s"]
        _require_limits("torque guard", values)


def _require_limits(where: str, values: dict[str, float]) -> None:
    wrong = [f"{name} is {value}" for name, value in values.items() if not 0.0 < value < math.inf]
    if wrong:
        raise ConfigMismatch(
            f"{where}: expected every limit finite and above 0, but {', '.join(wrong)}. "
            "Set the limits of this rig in [guard] and [inverters] of the rig file."
        )
