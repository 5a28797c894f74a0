"""The table ``[guard]`` of a rig file: what may be asked of the drives, and how far what comes back may be from it."""

from __future__ import annotations

import math
from enum import Enum
from typing import Annotated, Final

from pydantic import Field

from drivers.torque_guard import ErrorLimits
from hil.config.device_tables import InvertersTable
from hil.config.table import FileTable, Positive

ERROR_SHARE: Final = 0.05
"""Of the rated torque: how far a torque reading may be from its command where the rig file says nothing. A torque
reading comes from the currents the drive controls, so that it follows the command within the resolution of both, here
0.1 % each; the accuracy of the torque on the shaft, some 5 % of rated for traction drives, is not seen in it."""

LEAST_RESPONSE_S: Final = 0.01
"""Time in which a current loop follows [s]: some milliseconds."""


class WithoutDamper(Enum):
    """How a run continues whose damper was switched off."""

    CONTINUE = "continue"  # with its reference alone
    END = "end"  # at zero torque


class GuardTable(FileTable):
    """Limits of the torque guard besides the torque limit of each inverter; see `drivers.torque_guard`.

    ``torque_error_nm`` is that of one inverter, by default 5 % of its rated torque; ``torque_error_sum_nm`` that of
    both together, by default the root of the sum of both squares. ``torque_response_s`` is the time in which a drive
    follows its command, besides its torque slope: by default one period, 10 ms at least.
    """

    rate_limit_nm_per_s: Positive  # fastest change of one inverter's base torque
    prbs_limit_nm: Positive  # largest PRBS, and damper's torque, of one inverter
    sum_limit_nm: Positive  # largest magnitude of both torques together, sign counted
    feedback_timeout_s: Positive  # oldest feedback that a torque may be built on
    permissive_timeout_s: Positive = 1.0  # oldest permission of the PLC that a torque may be built on
    speed_limit_rad_s: Positive | None = None  # None: the PLC alone limits it
    torque_error_nm: Positive | None = None
    torque_error_sum_nm: Positive | None = None
    # times the tolerance: what the excess may sum to before the run ends
    torque_error_time_s: Annotated[float, Field(gt=0, le=1)] = 0.12
    torque_response_s: Annotated[float, Field(gt=0, le=10)] | None = None
    # how a run continues whose damper was switched off
    without_damper: Annotated[WithoutDamper, Field(strict=False)] = WithoutDamper.CONTINUE

    def error_limits(self, inverters: InvertersTable, period_s: float) -> ErrorLimits:
        """Give the limits of what comes back, with the defaults of these inverters."""
        m1_nm, m2_nm = (
            ERROR_SHARE * table.rated_torque_nm if self.torque_error_nm is None else self.torque_error_nm
            for table in (inverters.m1, inverters.m2)
        )
        both_nm = math.hypot(m1_nm, m2_nm) if self.torque_error_sum_nm is None else self.torque_error_sum_nm
        response_s = max(LEAST_RESPONSE_S, period_s)
        return ErrorLimits(
            m1_nm=m1_nm,
            m2_nm=m2_nm,
            sum_nm=both_nm,
            time_s=self.torque_error_time_s,
            response_s=response_s if self.torque_response_s is None else self.torque_response_s,
        )
