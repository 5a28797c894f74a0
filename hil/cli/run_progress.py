"""Progress of a run: a bar on a terminal, nothing anywhere else."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from hil.cli.printing import new_console
from hil.rig.experiments.base import Phase
from hil.rig.live_course import statement
from hil.rig.plan import Plan

if TYPE_CHECKING:
    from estimator.identification.chain import OnlineEstimate

SHOW_EVERY_S = 0.1
"""Time between two changes of the bar [s of the run]; the cycle has better things to do."""


class RunProgress:
    """The bar of one run, from `__enter__` to `__exit__`.

    Parameters
    ----------
    plan
        What is run; the bar counts its measured part.
    """

    def __init__(self, plan: Plan) -> None:
        console = new_console(stderr=True)
        self._bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.completed:.1f} of {task.total:.1f} s"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[estimate]}", markup=False),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task(plan.name, total=plan.experiment.duration_s, estimate="")
        self._name = plan.name
        self._shown: tuple[Phase, float] | None = None

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def show(self, phase: Phase, time_s: float, estimate: OnlineEstimate | None = None) -> None:
        """Take note of one cycle: its phase, the time since the phase began [s], and the estimate, if there is one."""
        if self._shown is not None and self._shown[0] is phase and time_s - self._shown[1] < SHOW_EVERY_S:
            return
        self._shown = (phase, time_s)
        measured_s = time_s if phase is Phase.MEASURE else None
        shown = "" if estimate is None else statement(estimate)
        self._bar.update(self._task, description=f"{self._name}: {phase.value}", completed=measured_s, estimate=shown)
