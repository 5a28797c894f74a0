"""The bus on the screen: what each device reports of itself, and what is wrong with it, in words."""

from __future__ import annotations

import math
import textwrap

from hil.monitor.messages import Health, NodeHealth, PlcHealth, TimingHealth
from hil.monitor.plot import title, wrapped
from hil.monitor.snapshot import SILENT_AFTER_S, WINDOW_S, Activity, Quality, Snapshot
from hil.rig.pacing import NS_PER_S, answer_timeout_ns

STALE_AFTER_PERIODS = 3.0
"""A TPDO older than this many periods is called stale."""

BAD_SHARE = 0.05
"""Share of the last samples that may be flagged before it is called trouble: one in twenty, which a busy machine
without real-time scheduling reaches now and then, and which the estimate does without."""

PLC_STALE_S = 1.0
"""As in a run, where a PLC silent for so long ends it."""

NO_BUS = "a recording is played: no bus"

UNKNOWN = (Activity.LOST, Activity.STARTING)
"""When what was known of the bus is known no more: while the drives are being armed there is no cycle."""

_LABELS = ("node", "power stage", "NMT state", "heartbeat", "TPDO age", "EMCY", "EMCY so far")


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


def health_summary(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Health in a few lines; what is wrong before figures, and how much of it has no room here."""
    health = snapshot.health
    if health is None or snapshot.headline.activity in UNKNOWN:
        return _nothing("bus", snapshot, width, height)
    period_s = health.timing.period_s
    head = [
        title("bus", verdict(snapshot, health), width),
        _node_line("m1", health.m1, period_s),
        _node_line("m2", health.m2, period_s),
        f"plc {plc_state(health.plc)}",
    ]
    wrong = [line for name, problem in problems(snapshot, health) for line in _folded(f"{name} {problem}", width)]
    room = height - len(head)
    if len(wrong) > room > 0:
        wrong = [*wrong[: room - 1], f"+{len(wrong) - room + 1} more lines: 4"]
    return [line[:width] for line in (*head, *wrong, *_brief_figures(health.timing, snapshot.quality))][:height]


def _brief_figures(timing: TimingHealth, quality: Quality) -> list[str]:
    _, p99_s, max_s = timing.lateness_s
    return [
        f"late p99 {_ms(p99_s)} max {_ms(max_s)} ms",
        f"samples {good(quality)}",
        quality.reasons,
    ]


def full(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Everything that is known of the bus, as a page."""
    health = snapshot.health
    if health is None or snapshot.headline.activity in UNKNOWN:
        return _nothing("bus health", snapshot, width, height)
    sections = (
        [
            title("bus health", verdict(snapshot, health), width),
            *(line for name, problem in problems(snapshot, health) for line in _folded(f"{name}: {problem}", width)),
        ],
        _node_table(health),
        [title("PLC", "", width), *_plc_lines(health.plc)],
        [
            title("samples", good(snapshot.quality), width),
            *_folded(snapshot.quality.reasons or "none flagged", width),
        ],
        _cycle_table(health.timing, width),
        _folded(_since(health.timing, snapshot.headline.activity), width),
    )
    lines: list[str] = []
    for section in sections:  # whole or not at all: half a table says nothing
        if not lines or len(lines) + len(section) <= height:
            lines += section
    return [line[:width] for line in lines][:height]


def _node_table(health: Health) -> list[str]:
    rows = zip(_LABELS, _rows(health.m1), _rows(health.m2), strict=True)
    return [
        f"{'':14}{'inverter m1':>24}{'inverter m2':>24}",
        *(f"{label:14}{left:>24}{right:>24}" for label, left, right in rows),
    ]


def _cycle_table(timing: TimingHealth, width: int) -> list[str]:
    return [
        title("cycle", f"period {1e3 * timing.period_s:g} ms", width),
        f"{'[ms]':14}{'p50':>10}{'p99':>10}{'max':>10}",
        f"{'lateness':14}" + "".join(f"{_ms(time_s):>10}" for time_s in timing.lateness_s),
        f"{'reply age':14}" + "".join(f"{_ms(time_s):>10}" for time_s in timing.reply_s),
    ]


def _nothing(name: str, snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Say why nothing is known of the bus."""
    match snapshot.headline.activity:
        case Activity.LOST:
            state, why = "LOST", f"no word of any device: {snapshot.headline.message}"
        case Activity.STARTING:
            state, why = "arming", "configured and armed by SDO; cycles begin when both drives are"
        case _:
            state, why = "", "no word of the bus yet" if snapshot.can_drive else NO_BUS
    return wrapped(title(name, state, width), why, width, height)


def _since(timing: TimingHealth, activity: Activity) -> str:
    """Tell the counts of the present stretch, which began with the rig at rest, or with the run."""
    began = "the run began" if activity in (Activity.RUNNING, Activity.STOPPING) else "the rig came to rest"
    limit_ms = 1e3 * answer_timeout_ns(round(timing.period_s * NS_PER_S)) / NS_PER_S
    return (
        f"Since {began}: {timing.cycles} cycles, {timing.missed} missed, {timing.late} late by more than half a "
        f"period, {timing.unanswered} answers missing or later than {limit_ms:g} ms."
    )


def _folded(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, max(width, 8), subsequent_indent="  ")


def _node_line(name: str, node: NodeHealth, period_s: float) -> str:
    age = "--" if node.tpdo_age_s is None else f"{1e3 * node.tpdo_age_s:.0f}"
    state = "EMCY" if node.emergency else "STALE" if is_stale(node, period_s) else node.power or "--"
    return f"{name} {state} TPDO {age} ms"


def _rows(node: NodeHealth) -> tuple[str, ...]:
    return (
        str(node.node_id),
        node.power or "--",
        node.nmt or "--",
        "never" if node.heartbeat_age_s is None else f"{1e3 * node.heartbeat_age_s:.0f} ms ago",
        "never" if node.tpdo_age_s is None else f"{1e3 * node.tpdo_age_s:.0f} ms",
        "none" if node.emergency is None else "ACTIVE, see above",
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
        f"status {1e3 * (plc.age_s or 0.0):.0f} ms old, watchdog {status.plc_count}, own PRBS "
        f"{'on' if status.prbs.enabled else 'off'}",
    ]


def _ms(time_s: float) -> str:
    return f"{1e3 * time_s:.2f}" if math.isfinite(time_s) else "--"
