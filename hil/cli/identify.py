"""``hil identify``: off line, the same recursive estimator, the output-error model, the spectral estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from hil.cli.options import Dbc, TrustLaws, hold, tell
from hil.cli.printing import new_console, say
from hil.errors import ModelFileError

if TYPE_CHECKING:
    from estimator.identification.identify import Compared, Study
    from estimator.identification.offline.validation import OrderChoice
    from estimator.identification.settings import Settings
    from estimator.physics.model import DrivelineModel
    from estimator.signals.record import Record
    from hil.provenance import Provenance

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil identify run_1.csv run_2.csv --out identified --model bus.toml")
def identify(
    recordings: list[Path] = typer.Argument(..., metavar="REC", help="Recordings to identify from."),
    out: Path = typer.Option(..., "--out", metavar="DIR", help="Folder for the results; made where missing."),
    model: Path | None = typer.Option(
        None,
        "--model",
        metavar="MODEL",
        help="Model file: how to read foreign recordings, and what to compare with.",
    ),
    samples: int = typer.Option(
        1024, "--samples", metavar="N", help="Good samples for the on-line estimate; 0 for all."
    ),
    sample_time: float | None = typer.Option(
        None,
        "--sample-time",
        metavar="SECONDS",
        help="Sampling period of all models, a multiple of the recording's. Without it: 20 ms on line, off line the "
        "recording's own.",
    ),
    order: str = typer.Option("4", "--order", metavar="N|auto", help="nA = nB; auto: by an information criterion."),
    delay: str = typer.Option("1", "--delay", metavar="N|auto", help="Total delay in samples; auto: the same way."),
    estimator: list[str] = typer.Option(
        [], "--estimator", metavar="NAME", help="Another recursive estimator to compare on the same data; repeatable."
    ),
    dbc: Dbc = None,
    trust_laws: TrustLaws = False,
    as_json: bool = typer.Option(False, "--json", help="Print identification.json instead of the table."),
) -> None:
    """Identify the driveline from each recording: models, resonance, damping, physical parameters.

    Writes DIR/identification.json with theta, A, B, poles, zeros, intervals, tests and the spectral estimate of each
    recording, and DIR/report.html.
    """
    from estimator.identification.identify import compare
    from estimator.identification.settings import Settings
    from hil.provenance import provenance
    from hil.recording.recordings import require_even_cycles
    from hil.report.identification_input import chosen_estimators, chosen_orders, start_values
    from hil.store import attach_to_runs
    from hil.store.entry import IDENTIFICATION

    hold(out)
    require_even_cycles(recordings)
    settings = Settings(samples=samples or None)
    if sample_time is not None:
        settings = replace(settings, sample_time_s=sample_time, offline_sample_time_s=sample_time)
    entries = chosen_estimators(estimator)
    records, expected = _read(recordings, model, dbc, trust_laws)
    settings, choice = chosen_orders(settings, order, delay, records)
    start = start_values(estimator, expected)
    studies = _identified(records, settings)
    compared = [
        compare(record, each.found, settings, name, entry, start)
        for record, each in zip(records, studies, strict=True)
        for name, entry in entries.items()
    ]
    made = provenance([] if model is None else [model], recordings)
    _publish(out, records, settings, studies, expected, choice, compared, made, as_json=as_json)
    for complaint in attach_to_runs(recordings, {IDENTIFICATION: out / "identification.json"}):
        say(complaint, err=True)


def _read(
    recordings: Sequence[Path], model: Path | None, dbc: Path | None, trust_laws: bool
) -> tuple[Sequence[Record], DrivelineModel | None]:
    """Read the recordings, as a model file says where there is one, and that."""
    from hil.config.model_file import read_model_for_recordings
    from hil.plants.scales import tell_doubts
    from hil.recording import read_records

    if model is None:
        records = read_records(recordings, None, dbc=dbc, tell=tell)
        tell_doubts(records, recordings, None, None, dbc, tell)
        return records, None
    file = read_model_for_recordings(model, trust_laws)
    if file.on_bench:
        raise ModelFileError(
            model, "structure | expected a driveline, which torque moves | got 'joint': diagnose or simulate it"
        )
    records = read_records(recordings, file.signals, dbc=dbc, tell=tell)
    tell_doubts(records, recordings, file.model, file.signals, dbc, tell)
    _tell_unused(records[0])
    return records, file.model


def _tell_unused(record: Record) -> None:
    """Say which signals the model file names and no estimator here takes."""
    unused = [f"the output {channel.label}" for channel in record.channels]
    if record.load_nm is not None:
        unused.append("the measured load torque")
    if unused:
        tell(f"identified from motor torque to the first output; not used: {', '.join(unused)}. See hil diagnose.")


def _identified(records: Sequence[Record], settings: Settings) -> list[Study]:
    """Identify from each and examine it, with a bar on standard error where that is a terminal."""
    from rich.progress import track

    from hil.report.identification_files import identify_all

    console = new_console(stderr=True)
    bar = partial(track, console=console, transient=True, disable=not console.is_terminal)
    return identify_all(records, settings, bar)


def _publish(
    out: Path,
    records: Sequence[Record],
    settings: Settings,
    studies: Sequence[Study],
    model: DrivelineModel | None,
    choice: OrderChoice | None,
    compared: Sequence[Compared],
    made: Provenance,
    *,
    as_json: bool,
) -> None:
    from hil.report.identification_files import PAGE, publish_identification
    from hil.report.identification_json import FILE_NAME
    from hil.report.identification_page import compared_summary, summary
    from hil.report.identification_wording import joint_statement, verdict, warnings

    text, nominal, together = publish_identification(out, records, settings, studies, model, made, choice, compared)
    if as_json:
        say(text, nl=False)
        return
    console = new_console()
    for each in studies:
        console.print(verdict(each), highlight=False, markup=False)
    console.print(summary(studies, nominal))
    if together is not None:
        console.print(joint_statement(together), highlight=False, markup=False)
    if compared:
        console.print(compared_summary(compared))
    for text in warnings(records, studies):
        console.print(f"note: {text}", highlight=False, markup=False)
    say(f"all of it: {out / FILE_NAME}    report: {out / PAGE}")
