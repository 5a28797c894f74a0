"""Share a base torque and a PRBS out to the two inverters."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.torque_guard import TorqueRequest

NO_TORQUE = TorqueRequest(0.0, 0.0, 0.0, 0.0)
"""What is asked for while nothing is driven."""


@dataclass(frozen=True, slots=True)
class Split:
    """The part of a total torque that inverter m1 gives, 0 to 1; m2 gives the rest.

    Both act on one shaft, so that any split makes the same total; which inverter carries the PRBS is what a
    mismatch of the two is found by.
    """

    base_m1: float
    prbs_m1: float

    def request(self, base_nm: float, prbs_nm: float) -> TorqueRequest:
        """Request for a total base torque [Nm] and a total PRBS [Nm]."""
        return TorqueRequest(
            base_m1_nm=self.base_m1 * base_nm,
            prbs_m1_nm=self.prbs_m1 * prbs_nm,
            base_m2_nm=(1.0 - self.base_m1) * base_nm,
            prbs_m2_nm=(1.0 - self.prbs_m1) * prbs_nm,
        )

    @property
    def largest_base_share(self) -> float:
        """Base share of the inverter that gives more: its limits are met first."""
        return max(self.base_m1, 1.0 - self.base_m1)
