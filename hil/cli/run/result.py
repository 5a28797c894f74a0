"""What a run came to, in lines or as JSON."""

from __future__ import annotations

import json
from typing import Any

from hil.cli.printing import say
from hil.cli.run.job import Job
from hil.rig.drive import RunSummary
from hil.rig.live_course import course_path
from hil.rig.realtime import NOT_ASKED, RealTimeGrants
from hil.rig.timing import timing_lines
from hil.store.entry import statements


def print_result(job: Job, summary: RunSummary, grants: RealTimeGrants, as_json: bool) -> None:
    """Print how a run went: samples, how evenly it ran, what the on-line estimate made of it."""
    if as_json:
        say(json.dumps(_document(job, summary, grants)))
        return
    say(
        f"{job.out}: {summary.recorded} samples, {summary.flagged} flagged; "
        f"latest cycle {summary.most_late_ns / 1e6:.1f} ms late"
    )
    for line in timing_lines(summary.timing):
        say(f"  {line}")
    if grants is not NOT_ASKED:
        say(f"  {grants.statement}")
    if job.trace is not None:
        say(f"{job.trace}: every frame of the bus")
    if job.live is not None and summary.recorded:
        say(f"{course_path(job.out)}: {job.live.course.statement}")
        if job.live.course.excitation:
            say(f"  {job.live.course.excitation}")
        for statement in statements(job.live.course.summary()):
            say(f"  alarm: {statement}")


def _document(job: Job, summary: RunSummary, grants: RealTimeGrants) -> dict[str, Any]:
    return {
        "schema": "hil.run/1",
        "recording": str(job.out),
        "trace": None if job.trace is None else str(job.trace),
        "cycles": summary.cycles,
        "recorded": summary.recorded,
        "flagged": summary.flagged,
        "most_late_ns": summary.most_late_ns,
        "timing": summary.timing.as_json(),
        "real_time": grants.as_json(),
        "online": None if job.live is None else job.live.course.summary(),
    }
