"""``hil commission``: the job step by step, from the first look for devices to model file and report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivers.foreign_file import read_regular_text
from hil.cli.options import Pace, PaceOption, TakeOver, TrustLaws, hold
from hil.cli.printing import new_console
from hil.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from hil.commission.engine import StepRequests
    from hil.commission.step import StepContext
    from hil.orders.operator import Talk

app = typer.Typer(add_completion=False)

RigFile = Annotated[Path, typer.Argument(metavar="RIG", help="Rig file.")]
Folder = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder of this commissioning; it is resumed there.")
]
DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Print the plan: steps, torques, time; opens no bus, writes nothing.")
]
Yes = Annotated[bool, typer.Option("--yes", help="Command torque without asking; for scripts.")]
Skip = Annotated[list[str] | None, typer.Option(metavar="STEP", help="Skip a step; may be repeated. Needs --because.")]
Because = Annotated[
    list[str] | None,
    typer.Option(metavar="TEXT", help="Why it is skipped, one for each --skip or one for all; it is recorded."),
]
Repeat = Annotated[
    list[str] | None, typer.Option(metavar="STEP", help="Do a step again that is done; may be repeated.")
]
KeepResults = Annotated[
    str, typer.Option(metavar="TEXT", help="After a change of the rig file: why results from before it are kept.")
]
Model = Annotated[
    Path | None,
    typer.Option(metavar="MODEL", help="Model file for predictions and the diagnosis; else one is made."),
]
Travel = Annotated[
    float | None,
    typer.Option(metavar="M_PER_RAD", min=1e-6, help="Distance of the vehicle in metres per radian of the shaft."),
]
Bus = Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")]
Modbus = Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON, progress on standard error.")]


@app.command(
    epilog="Example: hil commission examples/rig.toml --out commissioning. "
    "First look at it: hil commission examples/rig.toml --out commissioning --dry-run"
)
def commission(
    rig: RigFile,
    out: Folder,
    dry_run: DryRun = False,
    yes: Yes = False,
    skip: Skip = None,
    because: Because = None,
    repeat: Repeat = None,
    keep_results: KeepResults = "",
    model: Model = None,
    trust_laws: TrustLaws = False,
    travel: Travel = None,
    pace: PaceOption = Pace.REAL,
    bus: Bus = None,
    modbus: Modbus = None,
    take_over: TakeOver = False,
    as_json: AsJson = False,
) -> None:
    """Lead through commissioning, from devices and limits to models, diagnosis and what decides between explanations.

    Each step says what it will do and what torque it will command, and asks before it does. Ctrl-C, a lost permissive,
    a speed outside its band or a dead device end it at zero torque with the drives disarmed; the next call resumes at
    the step that was interrupted. Writes DIR/commissioning.html, DIR/model.toml, DIR/commission.json and DIR/runs/.
    """
    from hil.cli.commission_job import asked_of_steps, job_in, print_plan, who_answers
    from hil.config.rig_file import read_rig
    from hil.orders.order import RigSource

    asked = asked_of_steps(skip or (), because or (), repeat or ())
    read_rig(rig)  # names every fault of the file, and of what it names, by the line
    source = RigSource(rig, read_regular_text(rig), bus, modbus, take_over)
    console = new_console(stderr=as_json, highlight=False)
    if dry_run:
        print_plan(job_in(out, source, model, trust_laws, travel, pace, console), console, as_json)
        return
    hold(out)
    job = job_in(out, source, model, trust_laws, travel, pace, console)
    _to_its_report(job, who_answers(console, yes, keep_results), asked, console, as_json)


def _to_its_report(job: StepContext, talk: Talk, asked: StepRequests, console: Console, as_json: bool) -> None:
    """Go through the steps, and report however they end."""
    from hil.cli.commission_job import print_result, write_report

    try:
        _commission(job, talk, asked, console)
    except BaseException as error:
        reported = True
        try:
            write_report(job.state)
        except UsageError as trouble:  # what ended the job is what has to be reported first
            error.add_note(f"Its report is missing: {trouble}")
            reported = False
        print_result(job.state, console, as_json, reported)
        raise
    write_report(job.state)
    print_result(job.state, console, as_json, reported=True)


def _commission(job: StepContext, talk: Talk, asked: StepRequests, console: Console) -> None:
    from hil.cli.commission_job import Bar
    from hil.commission.engine import Commissioning
    from hil.commission.talk import findings_table

    pacer = job.runner.conditions.pacer(job.rig)  # refuses a pace this rig must not be driven at, before anything
    job.say(f"{job.rig.name}: commissioning in {job.folder}, one cycle every {pacer.period_ns / 1e6:g} ms")
    with Bar() as bar:
        job.progress = bar.show
        Commissioning(
            job, talk, asked, lambda step, findings: console.print(findings_table(step.title, findings))
        ).run()
