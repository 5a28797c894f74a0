"""``hil commission``: the job step by step, from the first look for devices to model file and report."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from hil.commission.engine import Asked
    from hil.commission.finding import Finding
    from hil.commission.order import RigSource
    from hil.commission.state import State
    from hil.commission.step import Job, Step
    from hil.commission.talk import Talk
    from hil.config.rig_file import Rig

REPORT = "commissioning.html"


class Pace(Enum):
    """What the cycles are paced by."""

    REAL = "real"
    FAST = "fast"


app = typer.Typer(add_completion=False)


@app.command(
    epilog="Example: hil commission examples/rig.toml --out commissioning. "
    "First look at it: hil commission examples/rig.toml --out commissioning --dry-run"
)
def commission(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Rig file.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder of this commissioning; it is resumed there.")
    ],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the plan: steps, torques, time; opens no bus, writes nothing.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Command torque without asking; for scripts.")] = False,
    skip: Annotated[
        list[str] | None, typer.Option(metavar="STEP", help="Skip a step; may be repeated. Needs --because.")
    ] = None,
    because: Annotated[
        list[str] | None,
        typer.Option(metavar="TEXT", help="Why it is skipped, one for each --skip or one for all; it is recorded."),
    ] = None,
    repeat: Annotated[
        list[str] | None, typer.Option(metavar="STEP", help="Do a step again that is done; may be repeated.")
    ] = None,
    keep_results: Annotated[
        str,
        typer.Option(metavar="TEXT", help="After a change of the rig file: why results from before it are kept."),
    ] = "",
    model: Annotated[
        Path | None, typer.Option(metavar="MODEL", help="Model file to predict with and to question; else one is made.")
    ] = None,
    travel: Annotated[
        float | None,
        typer.Option(metavar="M_PER_RAD", min=1e-6, help="Way of the vehicle in metres per radian of the motor shaft."),
    ] = None,
    pace: Annotated[Pace, typer.Option(help="By the wall clock, or as fast as a simulated rig answers.")] = Pace.REAL,
    bus: Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")] = None,
    modbus: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON, progress on standard error.")
    ] = False,
) -> None:
    """Lead through commissioning: devices, limits, signs, scales, friction, PRBS, experiments, models, diagnosis.

    Each step says what it will do and what torque it will command, and asks before it does. Ctrl-C, a lost permissive,
    a speed outside its band or a dead device end it at zero torque with the drives disarmed; the next call resumes at
    the step that was interrupted. Writes DIR/commissioning.html, DIR/model.toml, DIR/commission.json and DIR/runs/.
    """
    from rich.console import Console

    from hil.commission.lock import sole_use
    from hil.commission.order import RigSource
    from hil.config.rig_file import read_rig
    from hil.errors import UsageError
    from hil.report.outputs import require_folder

    asked = _asked(skip or (), because or (), repeat or ())
    read_rig(rig)  # names every fault of the file, and of what it names, by the line
    source = RigSource(rig, rig.read_text(encoding="utf-8"), bus, modbus)
    console = Console(stderr=as_json, highlight=False)
    if dry_run:
        _print_plan(_job(source, out, model, travel, pace, console), console, as_json)
        return
    require_folder(out)
    out.mkdir(parents=True, exist_ok=True)
    with sole_use(out):
        job = _job(source, out, model, travel, pace, console)
        try:
            _commission(job, _talk(console, yes, keep_results), asked, console)
        except BaseException as error:
            try:
                _write_report(job.state)
            except UsageError as trouble:  # what ended the job is what has to be told first
                error.add_note(f"Its report is missing: {trouble}")
            _print_result(job.state, console, as_json)
            raise
        _write_report(job.state)
        _print_result(job.state, console, as_json)


def _asked(skip: Sequence[str], because: Sequence[str], repeat: Sequence[str]) -> Asked:
    """Check what is asked of single steps."""
    from hil.commission.engine import Asked
    from hil.commission.registry import NAMES
    from hil.errors import UsageError

    for name in (*skip, *repeat):
        if name not in NAMES:
            raise UsageError(f"step {name!r}: expected one of {', '.join(NAMES)}. Name one of these.")
    if both := sorted(set(skip) & set(repeat)):
        raise UsageError(f"step {both[0]!r}: expected --skip or --repeat, came both. Leave one out.")
    if len(because) not in ({0} if not skip else {1, len(skip)}) or not all(text.strip() for text in because):
        raise UsageError(
            f"expected a reason for each of {len(skip)} skipped steps (--because TEXT, one for each or one for all), "
            f"came {len(because)}. A skipped step is recorded with its reason."
        )
    reasons = list(because) * (len(skip) if len(because) == 1 else 1)
    return Asked(dict(zip(skip, reasons, strict=True)), frozenset(repeat))


def _job(source: RigSource, out: Path, model: Path | None, travel: float | None, pace: Pace, console: Console) -> Job:
    from hil.commission.analysis.comfort import DEFAULT_TRAVEL_M_PER_RAD
    from hil.commission.record import StepRecord
    from hil.commission.registry import NAMES
    from hil.commission.runner import Runner
    from hil.commission.state import State, load_state
    from hil.commission.step import Job
    from hil.config.model_file import read_model

    rig = source.rig()
    state = load_state(out, NAMES) or State(
        out, rig.name, str(source.path), source.text, {name: StepRecord() for name in NAMES}
    )
    return Job(
        source=source,
        rig=rig,
        state=state,
        runner=Runner(source, out, _conditions(pace)),
        nominal=None if model is None else read_model(model).model,
        travel_m_per_rad=DEFAULT_TRAVEL_M_PER_RAD if travel is None else travel,
        travel_is_given=travel is not None,
        say=lambda line: console.print(line, markup=False, soft_wrap=not console.is_terminal),
        progress=lambda stage, share: None,
    )


def _conditions(pace: Pace) -> Any:
    from contextlib import nullcontext

    from hil.cli.run import Pace as RunPace
    from hil.cli.run import pacer_for
    from hil.cli.run_progress import RunProgress
    from hil.commission.runner import Conditions
    from hil.rig.realtime import NOT_ASKED, real_time

    def pacer(rig: Rig) -> Any:
        return pacer_for(rig, RunPace(pace.value))

    scheduling = real_time if pace is Pace.REAL else lambda: nullcontext(NOT_ASKED)
    return Conditions(pace.value, pacer, scheduling, RunProgress)


def _talk(console: Console, yes: bool, keep: str) -> Talk:
    """Choose who is asked: someone at the terminal, where standard input and output are one."""
    from hil.commission.talk import Person, Script

    if sys.stdin.isatty() and console.is_terminal:
        return Person(lambda question: console.input(question, markup=False), yes, keep)
    return Script(yes, keep)


def _commission(job: Job, talk: Talk, asked: Asked, console: Console) -> None:
    from hil.commission.engine import Commissioning

    pacer = job.runner.conditions.pacer(job.rig)  # refuses a pace this rig must not be driven at, before anything
    job.say(f"{job.rig.name}: commissioning in {job.folder}, one cycle every {pacer.period_ns / 1e6:g} ms")
    with _Bar() as bar:
        job.progress = bar.show
        Commissioning(job, talk, asked, lambda step, findings: _print_findings(console, step, findings)).run()


class _Bar:
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
        from hil.cli.diagnose import progress_bar

        if self._show is None:
            self._show = self._open.enter_context(progress_bar())
        self._show(stage, share)
        if share >= 1.0:
            self._open.close()
            self._show = None


def _print_findings(console: Console, step: Step, findings: list[Finding]) -> None:
    from hil.report.commission_text import findings_table

    console.print(findings_table(step.title, findings))


def _write_report(state: State) -> None:
    from hil.commission.registry import STEPS
    from hil.report.commission_html import commission_page
    from hil.report.outputs import publish

    page = commission_page(state.document(), {step.name: step.title for step in STEPS})
    publish(state.folder, {REPORT: lambda path: path.write_text(page, encoding="utf-8")})


def _print_plan(job: Job, console: Console, as_json: bool) -> None:
    import json

    from hil.commission.announce import plan_document
    from hil.report.commission_text import plan_lines

    document = plan_document(job)
    if as_json:
        typer.echo(json.dumps(document))
        return
    for line in plan_lines(document):
        console.print(line, markup=False, soft_wrap=not console.is_terminal)


def _print_result(state: State, console: Console, as_json: bool) -> None:
    import json

    from hil.report.commission_text import result_document, result_lines

    document = result_document(state.document(), str(state.folder), REPORT)
    if as_json:
        typer.echo(json.dumps(document))
        return
    for line in result_lines(document):
        console.print(line, markup=False, soft_wrap=True)
