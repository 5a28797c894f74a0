"""The base torque after cycles that did not take place: it continues from what the drives hold.

A plan gives the torque of a moment. Where the machine was late and cycles are missing, the plan has continued and the
drives have not: the step between the two is spread over as many cycles as the rate limit of the guard needs. Nothing
else is changed: a plan that is too fast by itself is for the guard to refuse.
"""

from __future__ import annotations


class CatchUp:
    """Base torque of both inverters together, cycle by cycle."""

    __slots__ = ("_behind", "_cycle", "_held_nm", "_most_nm")

    def __init__(self, most_nm: float) -> None:
        self._most_nm = most_nm
        self._cycle: int | None = None
        self._held_nm = 0.0
        self._behind = False

    def torque_nm(self, cycle: int, planned_nm: float) -> float:
        """Give what to ask for in a cycle whose plan is ``planned_nm`` [Nm]."""
        missing = self._cycle is not None and cycle > self._cycle + 1
        self._cycle = cycle
        if missing or self._behind:
            change_nm = planned_nm - self._held_nm
            self._behind = abs(change_nm) > self._most_nm
            if self._behind:
                planned_nm = self._held_nm + max(-self._most_nm, min(change_nm, self._most_nm))
        self._held_nm = planned_nm
        return planned_nm
