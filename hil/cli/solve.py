"""``hil solve``: diagnose, design, drive, diagnose again, until it is decided."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from drivers.foreign_file import read_regular_text
from hil.cli.diagnose import Effort
from hil.cli.options import Jobs, Pace, PaceOption, TakeOver, TrustLaws, hold, pacer_for, scheduling
from hil.cli.printing import new_console, say

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil solve examples/rig.toml --model bus.toml --out solved")
def solve(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Rig file.")],
    model: Annotated[Path, typer.Option("--model", metavar="MODEL", help="Model file of the driveline.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of recordings and verdict; resumed there.")],
    recordings: Annotated[
        list[Path] | None,
        typer.Option("--rec", metavar="REC", help="A recording of this rig to begin with; may be repeated."),
    ] = None,
    vehicle_s: Annotated[
        float,
        typer.Option("--vehicle-s", min=0.0, metavar="S", help="Time the vehicle may be needed for in all [s]."),
    ] = 600.0,
    yes: Annotated[bool, typer.Option("--yes", help="Command torque without asking; for scripts.")] = False,
    effort: Annotated[Effort, typer.Option("--effort", help="Work each search may cost.")] = Effort.NORMAL,
    trust_laws: TrustLaws = False,
    pace: PaceOption = Pace.REAL,
    bus: Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")] = None,
    modbus: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")] = None,
    take_over: TakeOver = False,
    jobs: Jobs = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Drive the experiments that decide what the recordings leave open, each asked for and through the torque guard.

    Begins with the recordings given, else with the rig file's first experiment. After each run the verdict is in DIR:
    diagnosis.json, augmented.toml, report.html. Ctrl-C ends a run at zero torque; the next call resumes.
    """
    from hil.cli.commission_job import Bar, who_answers
    from hil.cli.run_job import run_progress
    from hil.config.model_file import read_model_for_recordings
    from hil.config.rig_file import read_rig
    from hil.design.inputs import require_of_rig
    from hil.design.solve import Solving
    from hil.design.solve_state import keep_in, load_state
    from hil.orders.order import RigSource
    from hil.orders.runner import Conditions, Runner
    from hil.recording import read_records
    from hil.recording.recordings import read_facts

    hold(out)
    read_rig(rig)  # names every fault of the file by the line
    source = RigSource(rig, read_regular_text(rig), bus, modbus, take_over)
    file, given = read_model_for_recordings(model, trust_laws), recordings or []
    if given:
        require_of_rig(given, read_records(given, file.signals, file.on_bench), source.rig())
    console = new_console(stderr=as_json, highlight=False)
    conditions = Conditions(pace.value, lambda of: pacer_for(of, pace), lambda: scheduling(pace), run_progress)
    conditions.pacer(source.rig())  # refuses a pace this rig must not be driven at, before anything
    with Bar() as bar:
        state = load_state(out, source, model)
        job = Solving(
            out,
            source,
            file,
            model,
            Runner(source, out, conditions),
            who_answers(console, yes, "").may_command,
            state,
            given,
            effort.value,
            vehicle_s,
            state.driven[-1].last_rad_s if state.driven else 0.0,
            keep_in(out),
            lambda line: console.print(line, markup=False, soft_wrap=not console.is_terminal),
            bar.show,
            done=[named for path in given if (named := read_facts(path).metadata.get("experiment"))],
        )
        job.run()
    if as_json:
        say(json.dumps(job.document()))
