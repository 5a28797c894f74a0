"""Options that several commands share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli.command_line import is_silent
from hil.cli.printing import say
from hil.errors import UsageError
from hil.printable import printable
from hil.version import install_hint

if TYPE_CHECKING:
    from estimator.identification.settings import Settings
    from hil.config.rig_file import Rig
    from hil.rig.live import OnlineSetup
    from hil.rig.pacing import Pacer
    from hil.rig.realtime import RealTimeGrants


_HELD: ContextVar[tuple[ExitStack, set[Path]]] = ContextVar("held")

VARIABLE = "HIL_JOBS"


def hold(folder: Path) -> None:
    """Hold the folder of the results until the command ends: no other command writes there, nor computes for nothing.

    Raises a `UsageError` where another one is at work there, or nothing can be written.
    """
    from hil.result_folder import sole_use

    stack, held = _HELD.get()
    if folder.resolve() not in held:  # a command may be made of others
        stack.enter_context(sole_use(folder))
        held.add(folder.resolve())


@contextmanager
def letting_go() -> Iterator[None]:
    """Let go of what is held at the end of a command line."""
    with ExitStack() as stack:
        token = _HELD.set((stack, set()))
        try:
            yield
        finally:
            _HELD.reset(token)


Dbc = Annotated[
    Path | None,
    typer.Option(
        "--dbc", metavar="FILE", help="DBC file, or the drives' EDS or DCF: what the frames of a logged CAN bus mean."
    ),
]


def tell(line: str) -> None:
    """Tell what was recognised in a file or done to it, on standard error."""
    if not is_silent():
        say(f"note: {printable(line)}", err=True)


Mapped = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="KEY=NAME,...",
        help="Variables of an FMU: torque=T1,T2 (one: their sum), output=w, load_speed=w_L, load=T_L and start=w0,... "
        "(estimated).",
    ),
]

Signals = Annotated[
    Path | None,
    typer.Option(
        "--signals", metavar="FILE", help="File with the [signals] to read recordings by, where the model is an FMU."
    ),
]

Tuned = Annotated[
    list[str] | None,
    typer.Option(
        "--tune",
        metavar="NAME=20%",
        help="Parameter of an FMU, and to what its value is trusted, for re-tuning; or a TOML file of such lines.",
    ),
]

TrustFmu = Annotated[bool, typer.Option("--trust-fmu", help="Run the program in an FMU; without it FMUs are refused.")]


TrustLaws = Annotated[
    bool,
    typer.Option(
        "--trust-laws", help="Run the Python code that [laws] of the model file name; without it they are refused."
    ),
]


def use_cores(count: int | None) -> None:
    """Compute on so many cores; None leaves it as it is."""
    from estimator.physics.parallel import work_on

    if count is not None:
        work_on(count)


def use_cores_of_environment() -> None:
    """Compute on as many cores as ``HIL_JOBS`` says, where it is set."""
    text = os.environ.get(VARIABLE, "").strip()
    if not text:
        return
    if not text.isdecimal() or int(text) < 1:
        raise UsageError(f"{VARIABLE}: expected a whole number from 1 on, got {text!r}. Correct or unset it.")
    use_cores(int(text))


Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        min=1,
        metavar="N",
        help="Cores to compute on; all by default, or as many as HIL_JOBS says.",
        callback=use_cores,
    ),
]


Scheduler = Annotated[
    str | None,
    typer.Option(metavar="URL", help="Dask scheduler, tcp://… or tls://…; without it this machine's cores."),
]


def require_dask() -> None:
    """Refuse where the extra is not installed: imported by the commands alone that work on a cluster."""
    from importlib.util import find_spec

    if find_spec("distributed") is None:
        raise UsageError(f"expected Dask distributed, got none. Install it: {install_hint('fleet')}")


FilterOf = Annotated[
    Path | None,
    typer.Option(
        "--filter",
        metavar="FILE",
        help="identification.json of an earlier run: its orders, and its off-line model as the fixed filter.",
    ),
]
FilterRun = Annotated[
    str | None, typer.Option("--filter-run", metavar="NAME", help="Which recording of that file, if it has several.")
]


def with_filter(settings: Settings, path: Path | None, run: str | None) -> OnlineSetup:
    """Return settings with what identified an earlier run, and its filter L; as they are without a file."""
    from hil.rig.live import OnlineSetup

    if path is None:
        if run is not None:
            raise UsageError(f"--filter-run {run}: expected --filter FILE with it, got none")
        return OnlineSetup(settings)
    from hil.report.identification_input import identified

    found = identified(path, run, settings.adaptation, "--filter-run")
    return OnlineSetup(replace(found.settings, band_hz=settings.band_hz), found.L)


class Pace(Enum):
    """What the cycles are paced by."""

    REAL = "real"
    FAST = "fast"


PaceOption = Annotated[Pace, typer.Option(help="By the wall clock, or as fast as a simulated rig answers.")]


def pacer_for(rig: Rig, pace: Pace) -> Pacer:
    """Make the pacer of one run."""
    from hil.rig.pacing import FreePacer, RealTimePacer, period_ns
    from hil.simulator.addresses import IN_PROCESS, bus_address
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


TakeOver = Annotated[
    bool,
    typer.Option(
        "--take-over", help="Continue though another host is heard on the bus; refused where a drive may carry torque."
    ),
]
