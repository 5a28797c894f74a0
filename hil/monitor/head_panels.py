"""The lines above and below: what is happening, the last message."""

from __future__ import annotations

import math

from hil.monitor.snapshot import SILENT_AFTER_S, Activity, Headline, Snapshot

MORE = "… (5: log)"

QUIET = (Activity.CONNECTING, Activity.STARTING, Activity.LOST, Activity.PLAYED, Activity.ENDED)
"""When it is no news that nothing comes."""


def headline(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """One line: activity, run, phase and time on the left, the rig's name on the right."""
    head = snapshot.headline
    silent = head.silent_s > SILENT_AFTER_S and head.activity not in QUIET
    left = doing(head) + (f", NO NEWS for {head.silent_s:.0f} s" if silent else "")
    room = width - len(left) - 2
    name = head.rig if len(head.rig) <= room else head.rig[: max(0, room - 1)] + "…"
    return [f"{left}{name:>{max(0, width - len(left))}}"[:width]]


def doing(head: Headline) -> str:
    """Tell in words what is happening."""
    if head.activity in (Activity.RUNNING, Activity.STOPPING, Activity.STARTING, Activity.REPLAYING):
        time_s = "" if math.isnan(head.phase_s) else f" {head.phase_s:.1f} s"
        of = f" of {head.duration_s:g} s" if head.phase in ("measure", "") and math.isfinite(head.duration_s) else ""
        return " ".join(f"{head.activity.value} {head.experiment} {head.phase}{time_s}{of}".split())
    word: str = head.activity.value
    return word


def message(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Give the last thing the operator has to know; what has no room is on the log page."""
    text = " ".join(snapshot.headline.message.split())
    return [text if len(text) <= width else (text[: max(0, width - len(MORE))] + MORE)[:width]]
