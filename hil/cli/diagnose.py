"""``hil diagnose``: locate the mismatch, name the missing physics, model it, show the fit improve."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from hil.cli.command_line import is_silent
from hil.cli.options import Dbc, Jobs, Mapped, Signals, TrustFmu, TrustLaws, Tuned, hold, tell

HOLDOUT = "--holdout"

Progress = Callable[[str, float], None]


class Effort(Enum):
    """How much work a search may cost."""

    QUICK = "quick"
    NORMAL = "normal"
    THOROUGH = "thorough"


class SeveralHoldouts(TyperCommand):
    """A command whose ``--holdout`` takes every word up to the next option, as in the contract."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Repeat the option before each of its words, which is the form the parser knows."""
        return super().parse_args(ctx, _repeated(args))


def _repeated(args: list[str]) -> list[str]:
    out: list[str] = []
    inside = False
    for i, word in enumerate(args):
        if word.startswith("-"):
            inside = word == HOLDOUT and i + 1 < len(args) and not args[i + 1].startswith("-")
            out += [] if inside else [word]  # without a word to go with, the parser asks for it
        else:
            out += [HOLDOUT, word] if inside else [word]
    return out


app = typer.Typer(add_completion=False)


@app.command(
    cls=SeveralHoldouts,
    epilog="Example: hil diagnose run_1.csv run_2.csv --model bus.toml --out result --holdout run_3.csv",
)
def diagnose(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC", help="Recordings to explain.")],
    model: Annotated[
        Path, typer.Option("--model", metavar="MODEL", help="Model file, nominal or augmented, or an FMU.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    holdout: Annotated[
        list[Path] | None,
        typer.Option(HOLDOUT, metavar="REC...", help="Recordings kept out of the fit to test the result on."),
    ] = None,
    budget_s: Annotated[
        float | None,
        typer.Option(
            "--budget-s",
            min=0.0,
            metavar="S",
            help="Time after which it is ended, undecided [s]; by default there is no limit.",
        ),
    ] = None,
    effort: Annotated[
        Effort, typer.Option("--effort", help="Work the search may cost, the same on every machine.")
    ] = Effort.NORMAL,
    dbc: Dbc = None,
    signals: Signals = None,
    mapped: Mapped = None,
    tuned: Tuned = None,
    trust_fmu: TrustFmu = False,
    trust_laws: TrustLaws = False,
    jobs: Jobs = None,
    explain: Annotated[
        bool,
        typer.Option(
            "--explain", help="Print every set of effects that the search fitted, too (in diagnosis.json: effort.sets)."
        ),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print diagnosis.json instead of the summary.")] = False,
) -> None:
    """Say where simulation and recordings differ, and which physics the model lacks.

    Writes DIR/diagnosis.json, DIR/augmented.toml and DIR/report.html. In the place of an FMU a line is diagnosed that
    answers as it does; where there is none, what acts at its inputs, shafts and output is sought, and no augmented.toml
    written. DIR/augmented.ssp is the FMU with the effects around it, where none is inside.
    """
    from rich.console import Console

    from estimator.diagnosis.diagnose import diagnose as diagnose_records
    from hil.errors import UsageError
    from hil.plants.plant import Trust
    from hil.plants.questioned import GivenInput, questioned
    from hil.plants.scales import with_lines, with_the_line_to_write
    from hil.provenance import provenance
    from hil.recording.recordings import rig_of
    from hil.report.diagnosis_files import publish_diagnosis
    from hil.report.diagnosis_html import diagnosis_summary
    from hil.report.diagnosis_json import diagnosis_text
    from hil.report.fmu_terms import in_its_terms
    from hil.report.search_table import search_table
    from hil.store import attach_to_runs
    from hil.store.entry import DIAGNOSIS, MODEL

    hold(out)
    every = [*recordings, *(holdout or ())]
    asked = GivenInput(model, signals, mapped or (), Trust(trust_laws, trust_fmu), tuned or (), budget_s)
    with questioned(asked, every, dbc, tell) as found:
        file, records = found.file, found.records
        training, kept_back = records[: len(recordings)], records[len(recordings) :]
        with with_the_line_to_write(every, file.signals, dbc), progress_bar() as progress:
            diagnosis = diagnose_records(training, file.model, kept_back, progress, budget_s, effort.value)
            diagnosis = with_lines(diagnosis, every, file.signals, dbc)
    more = {}
    if found.fmu is not None:
        from hil.export.fmu.ssp import augmented_ssp

        diagnosis = in_its_terms(diagnosis, found.fmu, records[0].location)
        try:
            if (write := augmented_ssp(diagnosis, found.fmu, model, records[0])) is not None:
                more["augmented.ssp"] = write
        except UsageError as error:  # no C compiler
            tell(f"augmented.ssp is not written: {error}")
    made = provenance([model], every, rig_of(every))
    text = diagnosis_text(diagnosis, made)
    try:
        publish_diagnosis(out, diagnosis, file, records, every, made, more)
    finally:  # the verdict is printed even if the disk is full
        if as_json:
            typer.echo(text, nl=False)
        else:
            Console().print(diagnosis_summary(diagnosis))
            if explain:
                Console().print(search_table(diagnosis))
    results = {DIAGNOSIS: out / "diagnosis.json", **({} if file.is_foreign else {MODEL: out / "augmented.toml"})}
    for complaint in attach_to_runs(every, results):
        typer.echo(complaint, err=True)
    if not as_json:
        typer.echo(f"report: {out / 'report.html'}")


def _why_minutes() -> Progress:
    """Return what says once that a stage compiles, unless nothing is to be said."""
    from estimator.diagnosis.first_use import COMPILING

    has_said = is_silent()

    def show(stage: str, share: float) -> None:
        nonlocal has_said
        if COMPILING in stage and not has_said:
            typer.echo(stage, err=True)
            has_said = True

    return show


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Show stage and share done on standard error, where that is a terminal; else only why it takes minutes, once."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress as Bar, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _why_minutes()
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage, completed=share)
