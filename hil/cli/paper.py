"""``hil paper``: the paper's figures from eight experiments on the simulated rig, or from any recordings."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli.options import TrustLaws, hold
from hil.cli.printing import new_console, say
from hil.errors import UsageError

if TYPE_CHECKING:
    from estimator.identification.settings import Settings
    from hil.figures.local_model import ExperimentRow, LocalModel
    from hil.figures.road import Driven
    from hil.provenance import Provenance
    from hil.rig.drive import CycleProgress

PAGE, DATA = "report.html", "paper.json"

EXPERIMENTS = 8
"""As many local models as the paper's Fig. 5 has."""

PAPER_PERIOD_S = 0.02
"""Sampling period of the paper's models, on line and off line [s]."""

SHOWN_SIGNALS = 3
"""Recordings in the paper's Fig. 2."""

app = typer.Typer(add_completion=False)


@app.command(
    epilog="Example: hil paper --out out/paper. From recordings of your own: hil paper run_*.csv --model bus.toml "
    "--out out/paper"
)
def paper(
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(metavar="REC", help="Recordings to take; without any, eight are driven on a simulated rig."),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for figures, report, numbers and recordings.")
    ] = Path("out/paper"),
    model: Annotated[
        Path | None,
        typer.Option(
            "--model", metavar="MODEL", help="Model file: how to read foreign recordings, and what to compare with."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of payload, road, wind and driver of each experiment.")] = 1,
    duration: Annotated[float, typer.Option(metavar="SECONDS", help="Length of each experiment.")] = 30.0,
    delay: Annotated[
        int, typer.Option(metavar="N", min=0, help="Total delay of the models in samples; the paper's d is 1.")
    ] = 1,
    trust_laws: TrustLaws = False,
    as_json: Annotated[bool, typer.Option("--json", help=f"Print {DATA} instead of the table.")] = False,
) -> None:
    """Make the paper's Fig. 2, 4 and 5, in print quality and on a page, with the truth drawn in.

    Eight experiments at near-constant speed, each with a payload, road, wind and driver of its own, are driven over
    CANopen and Modbus. The same seed makes the same files. Writes DIR/fig2, fig4 and
    fig5 as .svg and .pdf, DIR/report.html, DIR/paper.json, and the recordings with their rig file.
    """
    from estimator.identification.linear_model import Orders
    from estimator.identification.settings import Settings
    from hil.figures.drawn import require_matplotlib
    from hil.provenance import provenance

    hold(out)
    require_matplotlib()
    settings = Settings(orders=Orders(nk=delay), offline_sample_time_s=PAPER_PERIOD_S)
    if recordings:
        made = provenance([] if model is None else [model], recordings)
        _publish(out, _recorded(recordings, model, trust_laws, settings), settings, made=made, as_json=as_json)
        return
    if model is not None:
        raise UsageError("hil paper: expected recordings with --model, got none: the simulated rig has its own model.")
    with tempfile.TemporaryDirectory(prefix="hil-paper-") as workshop:
        driven = _drive(Path(workshop), seed, duration)
        from hil.figures.road import driven_models

        _publish(out, driven_models(driven, settings), settings, driven, seed, as_json=as_json)


def _recorded(recordings: list[Path], model: Path | None, trust_laws: bool, settings: Settings) -> list[LocalModel]:
    from hil.config.model_file import read_model_for_recordings
    from hil.figures.road import recorded_models
    from hil.recording import read_records
    from hil.recording.recordings import require_even_cycles

    require_even_cycles(recordings)
    file = None if model is None else read_model_for_recordings(model, trust_laws)
    records = read_records(recordings, None if file is None else file.signals)
    return recorded_models(records, settings, None if file is None else file.model)


def _drive(workshop: Path, seed: int, duration_s: float) -> list[Driven]:
    from hil.figures.road import drive_all
    from hil.rig.stop import StopRequest, stop_on_signals

    if not 0.0 < duration_s < float("inf"):
        raise UsageError(f"--duration: expected a number of seconds above 0, got {duration_s:g}")
    stop = StopRequest()
    with stop_on_signals(stop), _bar(EXPERIMENTS, duration_s) as progress:
        return drive_all(workshop, seed, EXPERIMENTS, duration_s, stop, progress)


@contextmanager
def _bar(count: int, duration_s: float) -> Iterator[Callable[[int], CycleProgress]]:
    """Show seconds driven on standard error, where that is a terminal."""
    from rich.progress import BarColumn, Progress as Bar, TextColumn, TimeRemainingColumn

    from hil.rig.experiments.base import Phase

    console = new_console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("driving", total=count * duration_s)

        def experiment(number: int) -> CycleProgress:
            bar.update(task, description=f"experiment {number + 1} of {count}")

            def show(phase: Phase, time_s: float) -> None:
                if phase is Phase.MEASURE:
                    bar.update(task, completed=number * duration_s + time_s)

            return show

        yield experiment


def _publish(
    out: Path,
    models: list[LocalModel],
    settings: Settings,
    driven: list[Driven] | None = None,
    seed: int | None = None,
    *,
    made: Provenance | None = None,
    as_json: bool,
) -> None:
    from hil.figures.local_model import row_of
    from hil.report.paper_page import paper_page, paper_text
    from hil.result_folder import publish

    rows = [row_of(model) for model in models]
    conditions = [each.conditions for each in driven or ()]
    text = paper_text(rows, settings, conditions, seed if driven else None, made)

    def write_page(to: Path) -> None:  # shows the figures that are written before it
        to.write_text(paper_page(models, rows, conditions, to.parent, made), encoding="utf-8")

    publish(
        out,
        {
            **_figures(models),
            **_kept(driven or []),
            DATA: lambda to: to.write_text(text, encoding="utf-8"),
            PAGE: write_page,
        },
    )
    if as_json:
        say(text, nl=False)
        return
    new_console().print(_summary(rows))
    say(f"report: {out / PAGE}    figures: {out}/fig2, fig4, fig5 (.svg, .pdf)")


def _figures(models: list[LocalModel]) -> dict[str, Callable[[Path], object]]:
    from hil.figures.drawn import files_of, poles_figure, responses_figure, signals_figure

    return {
        **files_of("fig2", lambda: signals_figure([model.record for model in models[:SHOWN_SIGNALS]])),
        **files_of("fig4", lambda: responses_figure(models)),
        **files_of("fig5", lambda: poles_figure(models)),
    }


def _kept(driven: list[Driven]) -> dict[str, Callable[[Path], object]]:
    """Return what copies the recordings and the rig file they were driven with."""
    import shutil
    from functools import partial

    from hil.figures.road import RIG_FILE
    from hil.recording.description import sidecar_of

    recordings = [path for each in driven for path in (each.path, sidecar_of(each.path))]
    kept = {path.name: path for path in recordings} | ({"rig.toml": RIG_FILE} if driven else {})
    return {name: partial(shutil.copyfile, path) for name, path in kept.items()}


def _summary(rows: list[ExperimentRow]) -> object:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from hil.report.numbers import shown

    table = Table(title="Resonance and damping, on line", title_justify="left", box=SIMPLE_HEAD)
    for heading in ("experiment", "frequency", "error", "damping", "error", "fit", "status"):
        table.add_column(heading)
    for row in rows:
        errors = [100.0 * row.error(what, "online") for what in ("hz", "damping")]
        shares = ["" if error != error else f"{error:+.2f} %" for error in errors]
        table.add_row(
            row.name,
            shown(row.online_hz, "Hz"),
            shares[0],
            shown(row.online_damping),
            shares[1],
            shown(row.fit_percent, "%"),
            row.status,
        )
    return table
