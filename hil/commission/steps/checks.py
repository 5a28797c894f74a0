"""The first two steps: every device found and proven to stop, and each limit refused beyond. No torque."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from drivers.errors import CommandRefused, DriverError
from drivers.guard_limits import NS_PER_S
from drivers.plc.types import PlcStatus
from drivers.torque_guard import Evidence, GuardLimits, TorqueGuard, TorqueRequest
from hil.commission.state import StepFinding, stated
from hil.commission.step import Outcome, Step, StepContext
from hil.commission.steps import experiments
from hil.config.rig_file import Rig
from hil.orders.order import Order
from hil.orders.runner import rigid_model
from hil.rig.build import open_devices
from hil.rig.check import DeviceFinding as Found, DeviceVerdict, check_rig
from hil.rig.excitation import NO_TORQUE
from hil.rig.plan import plan_run
from hil.rig.plc_watch import max_speed_rad_s, plc_limits

MENDING = "Correct the rig file, or fix or connect the device it describes; see: hil check RIG"

BEYOND = 1.001
"""A probe is so many times its limit: by less than any drive resolves."""

FRESH = Evidence(0, 0, 0.0)
"""Feedback and permission of this moment, at rest."""

MAP = "Compare scale and unit of its register with the register map"

DEFECT = "Connect nothing; this is a defect of the program: report it"


def _about_devices(job: StepContext) -> str:
    return (
        "looks for both inverters and the PLC, compares identity, PDO map, scales and limits with rig file and EDS, "
        "and has each drive show that it stops when its host falls silent. Configures the drives; commands no torque."
    )


def _do_devices(job: StepContext) -> Outcome:
    found = check_rig(job.rig, prove_stop=True)
    written = 0
    if any(each.verdict is DeviceVerdict.DIFFERS for each in found):
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


def _protections(found: Found) -> list[StepFinding]:
    """Keep what stands between a dead host and torque, and who accepted what is missing."""
    return [
        stated(f"{found.device} if the host fails: {each.name}", str(each).partition(": ")[2])
        for each in found.protections
    ]


def _findings(found: Found) -> list[StepFinding]:
    expected = "there, and as rig file and EDS describe it"
    name = f"{found.device} at {found.address}"
    if found.differences:
        return [
            StepFinding(f"{name}: {each.what}", f"{each.expected} ({each.source})", each.found, False, MENDING, True)
            for each in found.differences
        ]
    agrees = found.verdict is DeviceVerdict.AGREES
    unfit = [note for note in found.notes if not note.startswith("EDS ")]
    advice = "" if agrees and not unfit else "Bring the vehicle into that state" if agrees else MENDING
    measured = "; ".join((found.verdict.value, *found.notes))
    return [StepFinding(name, expected, measured, agrees and not unfit, advice, True)]


DEVICES = Step("devices", "Devices", _about_devices, _do_devices)


@dataclass(frozen=True, slots=True)
class Probe:
    """A request at a limit, which passes, and one beyond it, which is refused."""

    what: str  # what the limit is of, in words
    limit: str  # with its unit
    at: TorqueRequest  # has to pass, with `evidence_at`
    beyond: TorqueRequest  # has to be refused, with `evidence_beyond`
    evidence_at: Evidence = FRESH  # ages and speed
    evidence_beyond: Evidence = FRESH  # ages and speed


def _about_limits(job: StepContext) -> str:
    return (
        "asks the torque guard for a little more than each limit of the rig file and checks that it refuses; compares "
        "the PLC's limits with what the runs need. Commands no torque."
    )


def _do_limits(job: StepContext) -> Outcome:
    limits = job.rig.guard_limits
    findings = [_probed(limits, probe) for probe in _probes(limits)]
    with open_devices(job.rig) as devices:
        status = devices.plc_loop.call(devices.plc.read_status())
        speeds = [speed for each in (devices.m1, devices.m2) if (speed := max_speed_rad_s(each)) is not None]
    read = tuple(plc_limits(status, job.rig, min(speeds, default=None)))
    believed = [
        StepFinding(f"PLC: {each.what}", f"at most {each.most}", each.found, each.believed, MAP, True)
        for each in read
        if each.most is not None
    ]
    findings += [_rate(limits), _silent(limits), *believed, *_needed(job, status)]
    return Outcome(findings, questions=[each.question for each in read if each.believed])


def _probes(limits: GuardLimits) -> Iterator[Probe]:
    both = (("m1", limits.torque_limit_m1_nm), ("m2", limits.torque_limit_m2_nm))
    for name, limit_nm in both:
        largest_nm = min(limit_nm, limits.sum_limit_nm)
        if largest_nm == limit_nm:
            what = f"torque of {name}"
            yield Probe(what, f"{limit_nm:g} Nm", _base(name, limit_nm), _base(name, BEYOND * limit_nm))
    each_nm = limits.sum_limit_nm / 2.0
    if each_nm <= min(limit_nm for _, limit_nm in both):
        at, beyond = (TorqueRequest(part, 0.0, part, 0.0) for part in (each_nm, BEYOND * each_nm))
        yield Probe("sum of both", f"{limits.sum_limit_nm:g} Nm", at, beyond)
    for name, limit_nm in both:
        if limits.prbs_limit_nm <= min(limit_nm, limits.sum_limit_nm):
            at, beyond = (_prbs(name, factor * limits.prbs_limit_nm) for factor in (1.0, BEYOND))
            yield Probe(f"PRBS of {name}", f"{limits.prbs_limit_nm:g} Nm", at, beyond)
    yield from _evidence_probes(limits)


def _evidence_probes(limits: GuardLimits) -> Iterator[Probe]:
    ages = (
        ("age of the feedback", "feedback_age_ns", limits.feedback_timeout_s),
        ("age of the PLC's permission", "permissive_age_ns", limits.permissive_timeout_s),
    )
    for what, name, limit_s in ages:
        old_ns = round(limit_s * NS_PER_S)
        at, beyond = replace(FRESH, **{name: old_ns}), replace(FRESH, **{name: round(BEYOND * old_ns)})
        yield Probe(what, f"{limit_s:g} s", NO_TORQUE, NO_TORQUE, at, beyond)
    limit_rad_s = limits.speed_limit_rad_s
    if math.isfinite(limit_rad_s):
        at, beyond = (replace(FRESH, speed_rad_s=factor * limit_rad_s) for factor in (1.0, BEYOND))
        yield Probe("speed", f"{limit_rad_s:g} rad/s", NO_TORQUE, NO_TORQUE, at, beyond)


def _base(name: str, torque_nm: float) -> TorqueRequest:
    return TorqueRequest(torque_nm, 0.0, 0.0, 0.0) if name == "m1" else TorqueRequest(0.0, 0.0, torque_nm, 0.0)


def _prbs(name: str, torque_nm: float) -> TorqueRequest:
    return TorqueRequest(0.0, torque_nm, 0.0, 0.0) if name == "m1" else TorqueRequest(0.0, 0.0, 0.0, torque_nm)


def _probed(limits: GuardLimits, probe: Probe) -> StepFinding:
    passes = _passes(limits, probe.at, probe.evidence_at)
    refuses = not _passes(limits, probe.beyond, probe.evidence_beyond)
    measured = f"{'passes' if passes else 'refused'} at it, {'refused' if refuses else 'passes'} 0.1 % beyond"
    expected = f"passes at {probe.limit}, refused beyond"
    return StepFinding(f"guard: {probe.what}", expected, measured, passes and refuses, DEFECT, True)


def _passes(limits: GuardLimits, request: TorqueRequest, evidence: Evidence) -> bool:
    """Ask a fresh guard, led up to the request as slowly as its rate limit wants."""
    guard = TorqueGuard(limits)
    guard.enable()
    largest = max(abs(request.base_m1_nm), abs(request.base_m2_nm))
    steps = max(1, math.ceil(largest / (limits.rate_limit_nm_per_s * limits.period_s)))
    period_ns = round(limits.period_s * NS_PER_S)
    try:
        for i in range(steps + 1):
            share = i / steps
            part = TorqueRequest(share * request.base_m1_nm, 0.0, share * request.base_m2_nm, 0.0)
            guard.check(part if i < steps else request, i * period_ns, evidence)
    except CommandRefused:
        return False
    return True


def _rate(limits: GuardLimits) -> StepFinding:
    """See that a base torque one period after zero passes as far as the rate limit allows, and no further."""
    allowed_nm = limits.rate_limit_nm_per_s * limits.period_s

    def jumps(torque_nm: float) -> bool:
        guard = TorqueGuard(limits)
        guard.enable()
        guard.check(NO_TORQUE, 0, FRESH)
        try:
            guard.check(_base("m1", torque_nm), round(limits.period_s * NS_PER_S), FRESH)
        except CommandRefused:
            return False
        return True

    passes, refuses = jumps(allowed_nm), not jumps(BEYOND * allowed_nm)
    measured = f"{'passes' if passes else 'refused'} at it, {'refused' if refuses else 'passes'} 0.1 % beyond"
    expected = f"passes at {limits.rate_limit_nm_per_s:g} Nm/s, refused beyond"
    return StepFinding("guard: rate of the base torque", expected, measured, passes and refuses, DEFECT, True)


def _silent(limits: GuardLimits) -> StepFinding:
    guard = TorqueGuard(limits)
    try:
        guard.check(_base("m1", 1.0), 0, FRESH)
    except CommandRefused:
        measured, within = "refused", True
    else:
        measured, within = "passes", False
    return StepFinding("guard: any torque before it is enabled", "refused", measured, within, DEFECT, True)


def _needed(job: StepContext, status: PlcStatus) -> Iterator[StepFinding]:
    """Compare what the PLC permits with what the largest of the runs to come need."""
    orders = experiments.orders(job)
    if not orders:
        return
    needed_nm = max(plan_run(job.source.ordered(order)[0], order.name).needs.torque_of_one_nm for order in orders)
    yield StepFinding(
        "PLC: torque limit of one inverter",
        f"at least {needed_nm:g} Nm",
        f"{status.torque_limit_nm:g} Nm",
        status.torque_limit_nm >= needed_nm,
        "Have the PLC permit as much, or lower torque_nm and amplitude_nm in the rig file",
        True,
    )
    fastest = max(_fastest_rad_s(job, order) for order in _fastest_of_each_kind(orders))
    yield StepFinding(
        "PLC: speed limit",
        f"at least {fastest:.1f} rad/s",
        f"{status.speed_limit_rad_s:g} rad/s",
        status.speed_limit_rad_s >= fastest,
        "Have the PLC permit as much, or lower the speeds of the experiments in the rig file",
        True,
    )


def _fastest_of_each_kind(orders: Sequence[Order]) -> list[Order]:
    """Choose one order of each kind: of those that hold a speed, the fastest."""
    by_kind: dict[str, Order] = {}
    for order in sorted(orders, key=lambda order: abs(float(order.table.get("speed_rad_s", 0.0)))):
        by_kind[order.table["kind"]] = order
    return list(by_kind.values())


def _fastest_rad_s(job: StepContext, order: Order) -> float:
    speed = job.runner.predict(order, rigid_model(job.rig), 0.0).speed_rad_s
    return max(abs(speed.low), abs(speed.high))


LIMITS = Step("limits", "Limits", _about_limits, _do_limits, needs=("devices",))
