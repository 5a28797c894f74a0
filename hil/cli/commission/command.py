"""The command ``hil commission``: what is asked for, one call on its folder at a time, a report at every end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.cli.commission.options import (
    AsJson,
    Because,
    Bus,
    DryRun,
    Folder,
    KeepResults,
    Modbus,
    Model,
    Repeat,
    RigFile,
    Skip,
    Travel,
    Yes,
)
from hil.cli.options import Pace, PaceOption, TrustLaws
from hil.cli.take_over_option import TakeOver

if TYPE_CHECKING:
    from rich.console import Console

    from hil.commission.engine import Asked
    from hil.commission.step import Job
    from hil.commission.talk import Talk


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
    """Lead through commissioning: devices, limits, signs, scales, friction, PRBS, experiments, models, diagnosis.

    Each step says what it will do and what torque it will command, and asks before it does. Ctrl-C, a lost permissive,
    a speed outside its band or a dead device end it at zero torque with the drives disarmed; the next call resumes at
    the step that was interrupted. Writes DIR/commissioning.html, DIR/model.toml, DIR/commission.json and DIR/runs/.
    """
    from hil.cli.commission.asked import asked_of_steps, who_answers
    from hil.cli.commission.job import job_in
    from hil.cli.commission.result import print_plan
    from hil.cli.printing import new_console
    from hil.commission.order import RigSource
    from hil.commission.state import sole_use
    from hil.config.rig_file import read_rig
    from hil.report.outputs import require_folder

    asked = asked_of_steps(skip or (), because or (), repeat or ())
    read_rig(rig)  # names every fault of the file, and of what it names, by the line
    source = RigSource(rig, rig.read_text(encoding="utf-8"), bus, modbus, take_over)
    console = new_console(stderr=as_json, highlight=False)
    if dry_run:
        print_plan(job_in(out, source, model, trust_laws, travel, pace, console), console, as_json)
        return
    require_folder(out)
    out.mkdir(parents=True, exist_ok=True)
    with sole_use(out):
        job = job_in(out, source, model, trust_laws, travel, pace, console)
        _to_its_report(job, who_answers(console, yes, keep_results), asked, console, as_json)


def _to_its_report(job: Job, talk: Talk, asked: Asked, console: Console, as_json: bool) -> None:
    """Go through the steps, and report however they end."""
    from hil.cli.commission.result import print_result, write_report
    from hil.errors import UsageError

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


def _commission(job: Job, talk: Talk, asked: Asked, console: Console) -> None:
    from hil.cli.commission.bar import Bar
    from hil.commission.engine import Commissioning
    from hil.commission.talk import findings_table

    pacer = job.runner.conditions.pacer(job.rig)  # refuses a pace this rig must not be driven at, before anything
    job.say(f"{job.rig.name}: commissioning in {job.folder}, one cycle every {pacer.period_ns / 1e6:g} ms")
    with Bar() as bar:
        job.progress = bar.show
        Commissioning(
            job, talk, asked, lambda step, findings: console.print(findings_table(step.title, findings))
        ).run()
