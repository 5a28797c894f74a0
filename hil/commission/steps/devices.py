"""Devices: every one found, the one the rig file describes, and proven to stop when its host falls silent.

A drive fresh from its maker differs in what each run writes by itself (PDO layout, option codes). So where a first look
finds differences, the drives are configured as a run would do it, each entry confirmed, and looked at again.
"""

from __future__ import annotations

from contextlib import suppress

from drivers.errors import DriverError
from hil.commission.finding import Finding, stated
from hil.commission.step import Job, Outcome, Step
from hil.config.rig_file import Rig
from hil.rig.build import open_devices
from hil.rig.check import Finding as Found
from hil.rig.check import Verdict, check_rig

MENDING = "Correct the rig file, or fix or connect the device it describes; see: hil check RIG"


def _about(job: Job) -> str:
    return (
        "looks for both inverters and the PLC, compares identity, PDO map, scales and limits with rig file and EDS, "
        "and has each drive show that it stops when its host falls silent. Configures the drives; commands no torque."
    )


def _do(job: Job) -> Outcome:
    found = check_rig(job.rig, prove_stop=True)
    written = 0
    if any(each.verdict is Verdict.DIFFERS for each in found):
        before = sum(len(each.differences) for each in found)
        _configure(job.rig)
        found = check_rig(job.rig, prove_stop=True)
        written = before - sum(len(each.differences) for each in found)
    findings = [finding for each in found for finding in (*_findings(each), *_protections(each))]
    if written > 0:
        findings.append(stated("entries written by configuring", str(written)))
    return Outcome(findings)


def _configure(rig: Rig) -> None:
    """Write what a run writes; what does not take it is found by the check that follows."""
    with suppress(DriverError), open_devices(rig) as devices:
        devices.m1.configure()
        devices.m2.configure()


def _protections(found: Found) -> list[Finding]:
    """Keep what stands between a dead host and torque, and who accepted what is missing."""
    return [
        stated(f"{found.device}, if its host is lost: {each.name}", str(each).partition(": ")[2])
        for each in found.protections
    ]


def _findings(found: Found) -> list[Finding]:
    expected = "there, and as rig file and EDS describe it"
    name = f"{found.device} at {found.address}"
    if found.differences:
        return [
            Finding(f"{name}: {each.what}", f"{each.expected} ({each.source})", each.found, False, MENDING, True)
            for each in found.differences
        ]
    agrees = found.verdict is Verdict.AGREES
    unfit = [note for note in found.notes if not note.startswith("EDS ")]
    advice = "" if agrees and not unfit else "Bring the vehicle into that state" if agrees else MENDING
    measured = "; ".join((found.verdict.value, *found.notes))
    return [Finding(name, expected, measured, agrees and not unfit, advice, True)]


STEP = Step("devices", "Devices", _about, _do)
