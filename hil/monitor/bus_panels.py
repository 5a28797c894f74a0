"""Panels of the bus: life signs of both inverters, the PLC, the cycle's timing; what is wrong is said in words."""

from __future__ import annotations

import math

from hil.monitor.messages import Health, NodeHealth, PlcHealth
from hil.monitor.plot import title
from hil.monitor.snapshot import Activity, Snapshot

NO_BUS = "a recording is played: no bus"

STALE_AFTER_PERIODS = 3.0
"""A TPDO older than this many periods is called stale."""

PLC_STALE_S = 1.0
"""As in a run, where a PLC silent for so long ends it."""


def brief(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Health in a few lines."""
    health = snapshot.health
    if snapshot.headline.activity is Activity.LOST:
        return [title("bus", "LOST", width), "no word of any device"[:width]]
    head = title("bus", "" if health is None else verdict(health), width)
    if health is None:
        return [head, NO_BUS[:width] if not snapshot.can_drive else "no word of the bus yet"]
    timing = health.timing
    lines = [
        head,
        _node_line("m1", health.m1, timing.period_s),
        _node_line("m2", health.m2, timing.period_s),
        f"plc {plc_state(health.plc)}",
        f"late p99 {_ms(timing.lateness_p99_s)} max {_ms(timing.lateness_max_s)} ms",
        f"late {timing.late} missed {timing.missed} no answer {timing.unanswered}",
        *(f"{name} {problem}" for name, problem in problems(health)),
    ]
    return [line[:width] for line in lines][:height]


def full(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Everything that is known of the bus, as a page."""
    health = snapshot.health
    if health is None or snapshot.headline.activity is Activity.LOST:
        return brief(snapshot, width, height)
    timing = health.timing
    lines = [
        title("bus health", verdict(health), width),
        f"{'':14}{'inverter m1':>24}{'inverter m2':>24}",
        *(
            f"{label:14}{left:>24}{right:>24}"
            for label, left, right in zip(_LABELS, _rows(health.m1), _rows(health.m2), strict=True)
        ),
        title("PLC", "", width),
        *_plc_lines(health.plc),
        title("cycle", f"period {1e3 * timing.period_s:g} ms", width),
        f"{'[ms]':14}{'p50':>10}{'p99':>10}{'max':>10}",
        f"{'lateness':14}{_ms(timing.lateness_p50_s):>10}{_ms(timing.lateness_p99_s):>10}"
        f"{_ms(timing.lateness_max_s):>10}",
        f"{'reply age':14}{_ms(timing.reply_p50_s):>10}{_ms(timing.reply_p99_s):>10}{_ms(timing.reply_max_s):>10}",
        f"{timing.cycles} cycles, {timing.late} late by more than half a period, {timing.missed} missed, "
        f"{timing.unanswered} answers missing",
        *(f"{name}: {problem}" for name, problem in problems(health)),
    ]
    return [line[:width] for line in lines][:height]


def verdict(health: Health) -> str:
    """Say in one word whether anything is wrong."""
    return "TROUBLE" if problems(health) else "OK"


def problems(health: Health) -> list[tuple[str, str]]:
    """Name everything that is wrong, by device."""
    found: list[tuple[str, str]] = []
    for name, node in (("m1", health.m1), ("m2", health.m2)):
        found += [(name, problem) for problem in _node_problems(node, health.timing.period_s)]
    if health.plc.trouble is not None:
        found.append(("plc", health.plc.trouble))
    elif health.plc.age_s is not None and health.plc.age_s > PLC_STALE_S:
        found.append(("plc", f"STALE: silent for {health.plc.age_s:.1f} s"))
    return found


def plc_state(plc: PlcHealth) -> str:
    """Drive mode, clutch and permissive in a few words."""
    if plc.status is None:
        return "no answer yet"
    permit = "permits" if plc.status.permissive else "NO PERMIT"
    return f"{plc.status.drive_mode.value} clutch {plc.status.clutch.value} {permit}"


def _node_problems(node: NodeHealth, period_s: float) -> list[str]:
    found = []
    if node.emergency is not None:
        found.append(node.emergency)
    if _is_stale(node, period_s):
        age = "never came" if node.tpdo_age_s is None else f"{node.tpdo_age_s:.1f} s old"
        found.append(f"STALE: TPDO {age}")
    if node.heartbeat_age_s is None or node.heartbeat_age_s > node.heartbeat_limit_s:
        age = "never came" if node.heartbeat_age_s is None else f"{node.heartbeat_age_s:.1f} s ago"
        found.append(f"HEARTBEAT LOST: last {age}")
    if node.trouble is not None:
        found.append(node.trouble)
    return found


def _is_stale(node: NodeHealth, period_s: float) -> bool:
    return node.tpdo_age_s is None or node.tpdo_age_s > STALE_AFTER_PERIODS * period_s


def _node_line(name: str, node: NodeHealth, period_s: float) -> str:
    age = "--" if node.tpdo_age_s is None else f"{1e3 * node.tpdo_age_s:.0f}"
    state = "EMCY" if node.emergency else "STALE" if _is_stale(node, period_s) else node.power or "--"
    return f"{name} {state}, TPDO {age} ms"


_LABELS = ("node", "power stage", "NMT state", "heartbeat", "TPDO age", "EMCY", "EMCY so far")


def _rows(node: NodeHealth) -> tuple[str, ...]:
    return (
        str(node.node_id),
        node.power or "--",
        node.nmt or "--",
        "never" if node.heartbeat_age_s is None else f"{1e3 * node.heartbeat_age_s:.0f} ms ago",
        "never" if node.tpdo_age_s is None else f"{1e3 * node.tpdo_age_s:.0f} ms",
        "none" if node.emergency is None else "ACTIVE, see below",
        str(node.n_emergencies),
    )


def _plc_lines(plc: PlcHealth) -> list[str]:
    status = plc.status
    if status is None:
        return ["no answer yet"]
    return [
        f"mode {status.drive_mode.value}, clutch {status.clutch.value}, permissive "
        f"{'present' if status.permissive else 'WITHDRAWN'}; limits {status.torque_limit_nm:g} Nm each, "
        f"{status.speed_limit_rad_s:g} rad/s",
        f"status {1e3 * (plc.age_s or 0.0):.0f} ms old, watchdog {status.watchdog.plc_count}, own PRBS "
        f"{'on' if status.prbs.enabled else 'off'}",
    ]


def _ms(time_s: float) -> str:
    return f"{1e3 * time_s:.2f}" if math.isfinite(time_s) else "--"
