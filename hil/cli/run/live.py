"""What estimates a run while it lasts, and its course in a file next to the recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hil.cli.options import with_filter
from hil.cli.printing import say
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.report.outputs import publish
from hil.rig.live_course import course_path

if TYPE_CHECKING:
    from hil.rig.live import LiveEstimate


def live_estimate(
    rig: Rig, recording: Path, filter_of: Path | None = None, filter_run: str | None = None
) -> LiveEstimate:
    """Make what estimates a run while it lasts."""
    from estimator.errors import BadSetting
    from hil.rig.live import LiveEstimate, tracking_chain, tracking_settings

    if course_path(recording).exists():
        raise UsageError(
            f"{course_path(recording)}: expected no such file, got one of an earlier run. Move it away, or choose "
            "another name with --out."
        )
    try:
        return LiveEstimate(tracking_chain(rig.period_s, *with_filter(tracking_settings(), filter_of, filter_run)))
    except BadSetting as error:
        raise UsageError(f"{error} Or record without an estimate: --no-estimate.") from error


def keep_course(live: LiveEstimate, path: Path) -> None:
    """Write the course of the estimate; where that can't be done, what ended the run is still reported."""
    try:
        publish(path.parent, {path.name: live.course.write})
    except UsageError as error:
        say(f"{path} is missing: {error}", err=True)
