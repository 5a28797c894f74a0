"""``--pace`` of the commands that drive a rig: by the wall clock, or as fast as a simulated one answers."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from hil.config.rig_file import Rig
    from hil.rig.pacing import Pacer
    from hil.rig.realtime import RealTimeGrants


class Pace(Enum):
    """What the cycles are paced by."""

    REAL = "real"
    FAST = "fast"


PaceOption = Annotated[Pace, typer.Option(help="By the wall clock, or as fast as a simulated rig answers.")]


def pacer_for(rig: Rig, pace: Pace) -> Pacer:
    """Make the pacer of one run.

    Raises
    ------
    UsageError
        If it is to be fast and the rig is none that is simulated on this machine.
    """
    from hil.rig.pacing import FreePacer, RealTimePacer, period_ns
    from hil.simulator.loopback import IN_PROCESS, bus_address
    from hil.simulator.rig_server import required_simulation

    if pace is Pace.REAL:
        return RealTimePacer(period_ns(rig.period_s))
    required_simulation(rig)
    if not rig.can.url.startswith(IN_PROCESS):
        bus_address(rig.can.url)  # a bus elsewhere may be a real one: SYNC would come at whatever rate it answers
    return FreePacer(period_ns(rig.period_s))


def scheduling(pace: Pace) -> AbstractContextManager[RealTimeGrants]:
    """Ask the operating system for real time as long as a run lasts, where it keeps to the wall clock."""
    from hil.rig.realtime import NOT_ASKED, real_time

    return real_time() if pace is Pace.REAL else nullcontext(NOT_ASKED)
