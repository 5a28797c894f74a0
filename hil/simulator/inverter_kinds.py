"""The faults of a simulated inverter that can be asked for by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from hil.simulator.fault_kind import Kind, Moment
from hil.simulator.fault_sizes import error_code, index, number
from hil.simulator.inverter_settings import FaultAtStep, InverterFaults, WrongTorque

OVERCURRENT: Final = 0x2310
"""EMCY error code of CiA 402: continuous over current at the output."""

NOBODY: Final = (0xBAD, 0xBAD)
"""Vendor-ID and product code of no device."""

Put = Callable[[InverterFaults, Moment], InverterFaults]


def _set(**fields: Any) -> Put:
    """Set fields of the faults; a callable value is made from the moment."""
    return lambda faults, when: replace(
        faults, **{name: value(when) if callable(value) else value for name, value in fields.items()}
    )


def _limit(**fields: Any) -> Put:
    """Set fields of the drive's limits."""
    return lambda faults, when: replace(
        faults, limits=replace(faults.limits, **{name: value(when) for name, value in fields.items()})
    )


def _add(field: str, chosen: Callable[[Moment], int]) -> Put:
    """Add an object to one of the sets of objects."""
    return lambda faults, when: replace(faults, **{field: getattr(faults, field) | {chosen(when)}})


def _step(when: Moment) -> int:
    return when.step


def _size(when: Moment) -> Any:
    return when.size


def _error(when: Moment) -> FaultAtStep:
    return FaultAtStep(when.step, when.size)


INVERTER_KINDS: Final[Mapping[str, Kind[InverterFaults]]] = MappingProxyType(
    {
        "absent": Kind(False, _set(absent=True)),
        "wrong_identity": Kind(False, _set(identity=NOBODY)),
        "refuse_mode": Kind(False, _add("ignored_writes", lambda when: 0x6060)),
        "stuck": Kind(False, _add("ignored_writes", lambda when: 0x6040)),
        "hang": Kind(True, _set(hang_at_step=_step)),
        "reset": Kind(True, _set(reset_at_step=_step)),
        "bus_off": Kind(True, _set(bus_off_at_step=_step)),
        "stale_pdo": Kind(True, _set(stale_from_step=_step)),
        "ignores_target": Kind(True, _set(ignores_target_from_step=_step)),
        "torque_gain": Kind(
            True,
            _set(wrong_torque=lambda when: WrongTorque(when.step, gain=when.size)),
            number("FACTOR", -10.0, 10.0, "times the torque asked for"),
        ),
        "torque_offset": Kind(
            True,
            _set(wrong_torque=lambda when: WrongTorque(when.step, offset_permille=when.size)),
            number("PERMILLE", -1e3, 1e3, "of rated torque"),
        ),
        "stale_share": Kind(False, _set(stale_share=_size), number("SHARE", 0.0, 1.0, "of the PDOs")),
        "fault": Kind(True, _set(fault=_error), error_code(OVERCURRENT)),
        "emcy": Kind(True, _set(emcy=_error), error_code()),
        "brown_out": Kind(True, _set(brown_out_at_step=_step)),
        "clock_drift": Kind(False, _set(clock_drift_ppm=_size), number("PPM", -1e5, 1e5, "parts per million")),
        "forgets": Kind(False, _add("ignored_writes", _size), index(), adds_up=True),
        "lacks": Kind(False, _add("missing_objects", _size), index(), adds_up=True),
        "locks": Kind(False, _add("locked_objects", _size), index(), adds_up=True),
        "field_weakening": Kind(False, _limit(base_speed_rad_s=_size), number("RAD_S", 1.0, 1e4, "rad/s")),
        "weak_cooling": Kind(False, _limit(continuous_permille=_size), number("PERMILLE", 1.0, 1e3, "of rated torque")),
        "coarse_torque": Kind(
            False,
            _limit(torque_step_permille=lambda when: round(when.size)),
            number("PERMILLE", 1.0, 100.0, "of rated torque"),
        ),
    }
)
