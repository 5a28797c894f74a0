"""``hil fleet``: the same diagnosis and identification over many recordings, on Dask."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli.diagnose import Effort
from hil.cli.options import Scheduler, hold, require_dask, tell
from hil.cli.printing import progress_bar, say

if TYPE_CHECKING:
    from hil.fleet.run import Done, Engine
    from hil.fleet.tasks import FleetJob

app = typer.Typer(add_completion=False, no_args_is_help=True)


@app.callback(epilog="Example: hil fleet diagnose drives/ --model bus.toml --out results")
def fleet() -> None:
    """Diagnose or identify many recordings, on this machine's cores or a Dask cluster."""


class GroupBy(Enum):
    """What is explained together."""

    RECORDING = "recording"
    VEHICLE = "vehicle"


Sources = Annotated[
    list[str],
    typer.Argument(metavar="SOURCES...", help="Recordings: files, folders, globs, or URLs of fsspec (s3://…)."),
]
Out = Annotated[Path, typer.Option("--out", metavar="DATASET", help="Folder of the results; continued there.")]
Workers = Annotated[
    int | None, typer.Option("--jobs", min=1, metavar="N", help="Workers on this machine; all cores, or HIL_JOBS.")
]
Memory = Annotated[str, typer.Option(metavar="SIZE", help="Of each worker on this machine, as in 2GiB.")]
Retries = Annotated[int, typer.Option(min=0, metavar="N", help="How often Dask tries again what a worker died of.")]
Limit = Annotated[float, typer.Option("--budget-s", min=1.0, metavar="S", help="Time that one result may take [s].")]
Pattern = Annotated[
    str | None,
    typer.Option(metavar="REGEX", help="Takes vehicle, rig and started from a path: (?P<vehicle>bus_[0-9]+)/."),
]
Dashboard = Annotated[
    bool,
    typer.Option(
        "--dashboard",
        help="Open Dask's own pages of this machine's workers on a port of 127.0.0.1: every user of the machine can "
        "read them, and they load style sheets from the internet.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the counts as JSON.")]


@app.command(epilog="Example: hil fleet diagnose drives/ --model bus.toml --out results")
def diagnose(
    sources: Sources,
    model: Annotated[Path, typer.Option("--model", metavar="MODEL", help="Model file, nominal or augmented.")],
    out: Out,
    by: Annotated[
        GroupBy, typer.Option(help="Each recording alone, or all of a vehicle together: its parameters shared.")
    ] = GroupBy.RECORDING,
    prior: Annotated[
        Path | None,
        typer.Option(metavar="DATASET", help="Results of this fleet: what is usual there replaces the nominal values."),
    ] = None,
    effort: Annotated[Effort, typer.Option("--effort", help="Work each search may cost.")] = Effort.NORMAL,
    pattern: Pattern = None,
    scheduler: Scheduler = None,
    jobs: Workers = None,
    memory: Memory = "auto",
    retries: Retries = 2,
    budget_s: Limit = 3600.0,
    dashboard: Dashboard = False,
    as_json: AsJson = False,
) -> None:
    """Diagnose every recording, or every vehicle's together.

    What is in DATASET is not computed again. A recording that can't be read, and one whose worker dies, are listed with
    the reason, and the rest continues.
    """
    require_dask()
    from dataclasses import replace

    from hil.config.model_file import read_model_for_recordings
    from hil.fleet.dataset import require_dataset
    from hil.fleet.page import usual_parameters
    from hil.fleet.pooling import with_prior
    from hil.fleet.tasks import DIAGNOSE, FleetJob
    from hil.provenance import Source

    file = read_model_for_recordings(model, False)
    named: tuple[str, ...] = ()
    if prior is not None:
        require_dataset(prior)
        prior_model, named = with_prior(file.model, usual_parameters(prior))
        file = replace(file, model=prior_model)
        tell(f"from the fleet: {', '.join(named) or 'nothing, it has too few vehicles'}")
    job = FleetJob(DIAGNOSE, file, model.name, Source.of(model).sha256, named, effort.value, budget_s)
    engine = _engine(scheduler, jobs, memory, retries, dashboard)
    _carry_out(sources, out, job, by is GroupBy.VEHICLE, pattern, engine, as_json)


@app.command(epilog="Example: hil fleet identify 's3://drives/2026-11/*.parquet' --out results")
def identify(
    sources: Sources,
    out: Out,
    model: Annotated[
        Path | None, typer.Option("--model", metavar="MODEL", help="Model file: how to read foreign recordings.")
    ] = None,
    pattern: Pattern = None,
    scheduler: Scheduler = None,
    jobs: Workers = None,
    memory: Memory = "auto",
    retries: Retries = 2,
    budget_s: Limit = 3600.0,
    dashboard: Dashboard = False,
    as_json: AsJson = False,
) -> None:
    """Identify the driveline from every recording: resonance, damping, physical parameters."""
    require_dask()
    from hil.config.model_file import read_model_for_recordings
    from hil.fleet.tasks import IDENTIFY, FleetJob
    from hil.provenance import Source

    if model is None:
        job = FleetJob(IDENTIFY, None, budget_s=budget_s)
    else:
        file = read_model_for_recordings(model, False)
        job = FleetJob(IDENTIFY, file, model.name, Source.of(model).sha256, budget_s=budget_s)
    _carry_out(sources, out, job, False, pattern, _engine(scheduler, jobs, memory, retries, dashboard), as_json)


@app.command(epilog="Example: hil fleet report results")
def report(
    dataset: Annotated[Path, typer.Argument(metavar="DATASET", help="Folder that diagnose or identify wrote.")],
) -> None:
    """Write DATASET/fleet.html: which vehicles have what since when, trends, each vehicle against its own fleet."""
    from hil.files import write_whole
    from hil.fleet.dataset import require_dataset, room
    from hil.fleet.page import FILE_NAME, fleet_page
    from hil.provenance import provenance

    require_dataset(dataset)
    page = fleet_page(dataset, provenance())
    with room(dataset):
        write_whole(dataset / FILE_NAME, page)
    say(f"report: {dataset / FILE_NAME}")


def _engine(scheduler: str | None, jobs: int | None, memory: str, retries: int, dashboard: bool) -> Engine:
    from estimator.physics.parallel import workers
    from hil.fleet.run import Engine

    return Engine(scheduler, jobs or workers(), memory, retries, dashboard)


def _carry_out(
    sources: list[str], out: Path, job: FleetJob, by_vehicle: bool, pattern: str | None, engine: Engine, as_json: bool
) -> None:
    import json
    from dataclasses import asdict

    from hil.errors import UsageError
    from hil.fleet.dataset import Writer
    from hil.fleet.known import Survey
    from hil.fleet.run import carry_out, connecting, survey
    from hil.fleet.sources import find, pattern_of

    hold(out)
    found, complaints = find(sources, pattern_of(pattern))
    for line in complaints:
        tell(line)
    if not found:
        raise UsageError("expected recordings, got none: " + "; ".join(complaints))
    known = Survey.of(out)
    with connecting(engine, tell) as connect, progress_bar() as progress:
        fleet = survey(connect, found, known, job, engine, progress)
        for line in fleet.remarks():
            tell(line)
        writer = Writer(out, job.command)
        writer.survey(known.rows())
        done = carry_out(connect, fleet, job, writer, engine, by_vehicle, progress)
    if as_json:
        say(json.dumps({**asdict(done), "duplicates": len(fleet.duplicates), "sources": complaints}))
    else:
        _say_done(out, done)


def _say_done(out: Path, done: Done) -> None:
    from hil.fleet.dataset import FAILURES, read

    for row in read(out, "failures"):
        say(f"not done: {row['url']}: {row['error']}", err=True)
    failed = f", {done.failed} failed: {out / FAILURES}" if done.failed else ""
    say(f"{done.computed} computed, {done.known} known before{failed}    results: {out}")
