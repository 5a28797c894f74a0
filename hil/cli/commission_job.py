"""The job of one call of ``hil commission``: rig and state, who answers, the bar of a computation, plan and result."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Self

from hil.cli.diagnose import progress_bar
from hil.cli.options import Pace, pacer_for, scheduling
from hil.cli.printing import say
from hil.cli.run_job import run_progress
from hil.commission.engine import NAMES, STEPS, StepRequests, plan_document
from hil.commission.prbs_design import DEFAULT_TRAVEL_M_PER_RAD
from hil.commission.state import CommissioningState, StepRecord, load_state
from hil.commission.step import StepContext
from hil.commission.talk import plan_lines, result_document, result_lines
from hil.config.model_file import read_model
from hil.errors import UsageError
from hil.orders.operator import Talk
from hil.orders.order import RigSource
from hil.orders.runner import Conditions, Runner
from hil.provenance import provenance
from hil.result_folder import publish

if TYPE_CHECKING:
    from rich.console import Console

REPORT, MODEL = "commissioning.html", "model.toml"


def job_in(
    folder: Path,
    source: RigSource,
    model: Path | None,
    trust_laws: bool,
    travel_m_per_rad: float | None,
    pace: Pace,
    console: Console,
) -> StepContext:
    """Make the job of a folder, with the state an earlier call has left there."""
    rig = source.rig()
    state = load_state(folder, NAMES) or CommissioningState(
        folder, rig.name, str(source.path), source.text, {name: StepRecord() for name in NAMES}
    )
    conditions = Conditions(pace.value, lambda rig: pacer_for(rig, pace), lambda: scheduling(pace), run_progress)
    return StepContext(
        source=source,
        rig=rig,
        state=state,
        runner=Runner(source, folder, conditions),
        nominal=None if model is None else read_model(model, trust_laws).model,
        travel_m_per_rad=DEFAULT_TRAVEL_M_PER_RAD if travel_m_per_rad is None else travel_m_per_rad,
        travel_is_given=travel_m_per_rad is not None,
        say=lambda line: console.print(line, markup=False, soft_wrap=not console.is_terminal),
        progress=lambda stage, share: None,
    )


def asked_of_steps(skip: Sequence[str], because: Sequence[str], repeat: Sequence[str]) -> StepRequests:
    """Put together what is asked of single steps."""
    for name in (*skip, *repeat):
        if name not in NAMES:
            raise UsageError(f"step {name!r}: expected one of {', '.join(NAMES)}. Name one of these.")
    if both := sorted(set(skip) & set(repeat)):
        raise UsageError(f"step {both[0]!r}: expected --skip or --repeat, got both. Leave one out.")
    if len(because) not in ({0} if not skip else {1, len(skip)}) or not all(text.strip() for text in because):
        raise UsageError(
            f"expected a reason for each of {len(skip)} skipped steps (--because TEXT, one for each or one for all), "
            f"got {len(because)}. A skipped step is recorded with its reason."
        )
    reasons = list(because) * (len(skip) if len(because) == 1 else 1)
    return StepRequests(dict(zip(skip, reasons, strict=True)), frozenset(repeat))


def who_answers(console: Console, yes: bool, keep: str) -> Talk:
    """Choose who is asked: someone at the terminal, where standard input and output are one."""
    at_a_terminal = sys.stdin.isatty() and console.is_terminal
    return Talk((lambda question: console.input(question, markup=False)) if at_a_terminal else None, yes, keep)


class Bar:
    """A bar of a computation, on standard error where that is a terminal; there from its first word to its last.

    In between the terminal belongs to runs and questions.
    """

    def __init__(self) -> None:
        self._open = ExitStack()
        self._show: Callable[[str, float], None] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._open.close()

    def show(self, stage: str, share: float) -> None:
        """Show what is being done and the share of the work behind it; 1 ends the bar."""
        if self._show is None:
            self._show = self._open.enter_context(progress_bar())
        self._show(stage, share)
        if share >= 1.0:
            self._open.close()
            self._show = None


def write_report(state: CommissioningState) -> None:
    """Write the commissioning report into the folder of the job, and into the state what it was made from."""
    from hil.report.commission_html import commission_page  # brings the plotting library along

    runs = [run for record in state.steps.values() for run in record.runs if run.recording]
    recordings = [path for run in runs if (path := state.folder / str(run.recording)).is_file()]
    models = [path for path in (Path(state.rig_path), state.folder / MODEL) if path.is_file()]
    made = provenance(models, recordings)
    page = commission_page(state.document(), {step.name: step.title for step in STEPS}, made)
    publish(state.folder, {REPORT: lambda path: path.write_text(page, encoding="utf-8")})
    state.made = made.document()
    state.save()


def print_plan(job: StepContext, console: Console, as_json: bool) -> None:
    """Print what the job would do."""
    document = plan_document(job)
    if as_json:
        say(json.dumps(document))
        return
    for line in plan_lines(document):
        console.print(line, markup=False, soft_wrap=not console.is_terminal)


def print_result(state: CommissioningState, console: Console, as_json: bool, reported: bool) -> None:
    """Print what has come of the job so far; ``reported`` tells whether its report could be written."""
    document = result_document(state.document(), str(state.folder), REPORT if reported else None)
    if as_json:
        say(json.dumps(document))
        return
    for line in result_lines(document):
        console.print(line, markup=False, soft_wrap=True)
