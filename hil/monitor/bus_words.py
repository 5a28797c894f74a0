"""The state of the bus in words: what is wrong, by device; nothing is shown by colour alone."""

from __future__ import annotations

import math

from hil.monitor.messages import Health, NodeHealth, PlcHealth
from hil.monitor.quality import WINDOW_S, Quality
from hil.monitor.snapshot import SILENT_AFTER_S, Snapshot

STALE_AFTER_PERIODS = 3.0
"""A TPDO older than this many periods is called stale."""

BAD_SHARE = 0.05
"""Share of the last samples that may be flagged before it is called trouble: one in twenty, which a busy machine
without real-time scheduling reaches now and then, and which the estimate does without."""

PLC_STALE_S = 1.0
"""As in a run, where a PLC silent for so long ends it."""


def verdict(snapshot: Snapshot, health: Health) -> str:
    """Say in one word whether anything is wrong."""
    if snapshot.headline.silent_s > SILENT_AFTER_S:
        return f"NO NEWS {snapshot.headline.silent_s:.0f} s"
    return "TROUBLE" if problems(snapshot, health) else "OK"


def problems(snapshot: Snapshot, health: Health) -> list[tuple[str, str]]:
    """Name everything that is wrong, by device."""
    found: list[tuple[str, str]] = []
    for name, node in (("m1", health.m1), ("m2", health.m2)):
        found += [(name, problem) for problem in _node_problems(node, health.timing.period_s)]
    if health.plc.trouble is not None:
        found.append(("plc", health.plc.trouble))
    elif health.plc.age_s is not None and health.plc.age_s > PLC_STALE_S:
        found.append(("plc", f"STALE: silent for {health.plc.age_s:.1f} s"))
    quality = snapshot.quality
    if quality.bad_share > BAD_SHARE:
        found.append(("samples", f"{100.0 * quality.bad_share:.0f} % FLAGGED: {quality.against[0][0]}"))
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
    if is_stale(node, period_s):
        age = "never came" if node.tpdo_age_s is None else f"{node.tpdo_age_s:.1f} s old"
        found.append(f"STALE: TPDO {age}")
    if node.heartbeat_age_s is None or node.heartbeat_age_s > node.heartbeat_limit_s:
        age = "never came" if node.heartbeat_age_s is None else f"{node.heartbeat_age_s:.1f} s ago"
        found.append(f"HEARTBEAT LOST: last {age}")
    if node.trouble is not None:
        found.append(node.trouble)
    return found


def is_stale(node: NodeHealth, period_s: float) -> bool:
    """Whether its last TPDO is too old, or there never was one."""
    return node.tpdo_age_s is None or node.tpdo_age_s > STALE_AFTER_PERIODS * period_s


def good(quality: Quality) -> str:
    """Tell how many of the last samples are good, rounded down: 100 % is all of them."""
    if not quality.samples:
        return "none good yet"
    return f"{math.floor(1000.0 * quality.good / quality.samples) / 10.0:g} % good in {WINDOW_S:g} s"
