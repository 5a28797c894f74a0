"""The lines above and below: what is going on, the last message; and the log."""

from __future__ import annotations

import math

from hil.monitor.plot import title
from hil.monitor.snapshot import Activity, Headline, Snapshot

NS_PER_S = 1_000_000_000


def headline(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """One line: activity, run, phase and time on the left, the rig's name on the right."""
    head = snapshot.headline
    left = doing(head)
    room = width - len(left) - 2
    name = head.rig if len(head.rig) <= room else head.rig[: max(0, room - 1)] + "…"
    return [f"{left}{name:>{max(0, width - len(left))}}"[:width]]


def doing(head: Headline) -> str:
    """Tell in words what is going on."""
    if head.activity in (Activity.RUNNING, Activity.STOPPING, Activity.STARTING, Activity.REPLAYING):
        time_s = "" if math.isnan(head.phase_s) else f" {head.phase_s:.1f} s"
        of = f" of {head.duration_s:g} s" if head.phase in ("measure", "") and math.isfinite(head.duration_s) else ""
        return " ".join(f"{head.activity.value} {head.experiment} {head.phase}{time_s}{of}".split())
    word: str = head.activity.value
    return word


def message(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Give the last thing the operator has to know."""
    return [snapshot.headline.message[:width]]


def log(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """List what happened, the latest first, with the seconds since."""
    lines = [title("log, latest first", f"{snapshot.runs} runs", width)]
    for notice in reversed(snapshot.log):
        ago_s = (snapshot.now_ns - notice.t_ns) / NS_PER_S
        text = " ".join(notice.text.split())
        first = f"{ago_s:7.0f} s ago {notice.kind.value:5} "
        room = max(1, width - len(first))
        pieces = [text[at : at + room] for at in range(0, len(text), room)] or [""]
        lines += [first + pieces[0], *(" " * len(first) + piece for piece in pieces[1:3])]
        if len(lines) >= height:
            break
    return [line[:width] for line in lines][:height]
