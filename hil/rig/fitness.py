"""Whether the PLC reports a vehicle that may be driven for identification: a list of reasons against it.

Identification needs the series or electric mode with the clutch open: with it closed the combustion engine
turns with the motor shaft, and the driveline is another one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from drivers.plc.types import ClutchState, DriveMode, PlcStatus

FIT_MODES = (DriveMode.SERIES, DriveMode.ELECTRIC)


@dataclass(frozen=True, slots=True)
class Needs:
    """What a run needs of the vehicle: the largest torque it asks of one inverter, PRBS included [Nm]."""

    torque_of_one_nm: float


def reasons_against(status: PlcStatus, needs: Needs) -> Iterator[str]:
    """Name everything that speaks against driving; nothing if the vehicle is fit."""
    if status.drive_mode not in FIT_MODES:
        wanted = " or ".join(mode.value for mode in FIT_MODES)
        yield f"drive mode is {status.drive_mode.value}, expected {wanted}"
    if status.clutch is not ClutchState.OPEN:
        yield f"clutch is {status.clutch.value}, expected open"
    if not status.permissive:
        yield "permissive is withdrawn, expected present"
    if status.torque_limit_nm < needs.torque_of_one_nm:
        yield (
            f"torque limit of one inverter is {status.torque_limit_nm:g} Nm, expected at least the "
            f"{needs.torque_of_one_nm:g} Nm this experiment may ask for"
        )


def changes(before: PlcStatus, status: PlcStatus, needs: Needs) -> Iterator[str]:
    """Name everything that speaks against driving on, given what was reported when the run began."""
    yield from reasons_against(status, needs)
    if status.drive_mode in FIT_MODES and status.drive_mode is not before.drive_mode:
        yield f"drive mode is {status.drive_mode.value}, expected {before.drive_mode.value} as at the start"
