"""What a maker's EDS or DCF answers of a new rig file by itself, and the lines it makes necessary there."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from drivers.capability.plan import DrivePlan
from drivers.capability.table import Function
from drivers.datasheet.text import EdsSection, Severity, read_eds_text
from drivers.datasheet.types import read_number
from drivers.eds_check import EdsReport, check_eds
from drivers.eds_check.needs import RigLine, usual_mode
from hil.config.new_rig.questions import BY_NAME
from hil.errors import InputError

SIMULATED_ACCEPTANCE = '{ by = "hil rig new --simulated", why = "simulated drives: no shaft turns" }'


@dataclass(frozen=True, slots=True)
class NewDrive:
    """Both inverters of a new rig file, by their data sheet.

    Attributes
    ----------
    defaults
        Answers to the questions, by name.
    lines
        Lines for ``[inverters.m1]`` and ``[inverters.m2]``, comments included.
    report
        What the check of the file said.
    """

    defaults: Mapping[str, str]
    lines: tuple[str, ...]
    report: EdsReport


def new_drive(eds: Path, rig_file: Path, simulated: bool) -> NewDrive:
    """Read a drive's data sheet for a new rig file."""
    report = check_eds(eds)
    if report.plan is None or not report.usable:
        first = next(each for each in report.findings if each.severity is Severity.ERROR)
        line = "" if first.line is None else f"line {first.line}, "
        raise InputError(f"EDS {eds} is not usable: {line}{first} For all of it: hil check --eds {eds}")
    defaults = {
        **_identity(report.plan, eds),
        **_commissioned(report.plan),
        "mode": usual_mode(report.plan).name.lower(),
    }
    if simulated:
        defaults = {**_simulated(report.plan), **defaults}
    path = os.path.relpath(eds.resolve(), rig_file.resolve().parent)
    lines = (f'eds = "{Path(path).as_posix()}"  # relative to this file', *_lines(report, simulated))
    return NewDrive(defaults, lines, report)


def _identity(plan: DrivePlan, eds: Path) -> dict[str, str]:
    """Take vendor and product from object 0x1018, or else from what the file says of the device."""
    section = read_eds_text(eds).section("DeviceInfo")
    keys = (("vendor_id", 1, "VendorNumber"), ("product_code", 2, "ProductNumber"))
    found = {name: _number(plan.sheet.value(0x1018, subindex), section, key) for name, subindex, key in keys}
    return {name: f"0x{value:X}" for name, value in found.items() if value is not None}


def _number(value: int | None, section: EdsSection | None, key: str) -> int | None:
    return value if value is not None or section is None else read_number(section.get(key) or "")


def _commissioned(plan: DrivePlan) -> dict[str, str]:
    """Take node id and bit rate from a DCF."""
    commissioning = plan.sheet.commissioning
    if commissioning is None:
        return {}
    found = {}
    node = commissioning.node_id
    if node is not None:
        found = {"node_m1": str(node), "node_m2": str(node + 1 if node < 127 else node - 1)}
    if commissioning.bit_rate_kbit_s is not None:
        found["can"] = f"socketcan:can0?bitrate={1000 * commissioning.bit_rate_kbit_s}"
    return found


def _simulated(plan: DrivePlan) -> dict[str, str]:
    """Keep a simulated rig within the max torque the drives are simulated with, and its cruise within that torque."""
    usual_nm, rated_nm = (float(BY_NAME[name].simulated) for name in ("torque_limit_nm", "rated_torque_nm"))
    values = [plan.sheet.value(part.index) for part in plan.abilities[Function.MAXIMUM_TORQUE].parts]
    known = [abs(value) for value in values if value]  # 0 is a place left free
    limit_nm = min(usual_nm, *(value * rated_nm / 1000.0 for value in known)) if known else usual_nm
    speed = float(BY_NAME["speed_rad_s"].simulated) * limit_nm / usual_nm
    return {"product_code": "0", "torque_limit_nm": f"{limit_nm:g}", "speed_rad_s": f"{speed:g}"}


def _lines(report: EdsReport, simulated: bool) -> Iterator[str]:
    for line in report.lines:
        if line.key == "mode":
            continue
        if simulated and line.key.startswith("accepted."):
            yield f"{line.key} = {SIMULATED_ACCEPTANCE}  # {line.reason}"
        elif simulated or not _is_guess(line):
            yield f"{line.text}  # {line.reason}"
        else:
            yield f"# {line.text}  # {line.reason}"
    rated = None if report.plan is None else report.plan.sheet.commissioned(0x6076)
    if rated:
        yield f"# 0x6076 is {rated} in the DCF: {rated / 1000:g} Nm if in mNm; some drives have uNm: rated_torque_unit"


def _is_guess(line: RigLine) -> bool:
    """Whether a person has to fill the line in."""
    return line.key == "speed_unit" or line.key.startswith("accepted.")
