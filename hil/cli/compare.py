"""``hil compare``: simulation against recording, in figures and plots."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.dbc_option import Dbc, tell
from hil.cli.trust_option import TrustLaws

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil compare bus.toml run_1.csv run_2.csv --out comparison")
def compare(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Model file, nominal or augmented.")],
    recordings: Annotated[list[Path], typer.Argument(metavar="REC", help="Recordings to compare with.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for compare.html and compare.json.")] = None,
    dbc: Dbc = None,
    trust_laws: TrustLaws = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Simulate each recording from its torques and say how far the output is off.

    Only initial state and constant load torque are estimated; the model's parameters stay as they are.
    """
    from rich.console import Console

    from hil.config.model_file import read_model_for_recordings
    from hil.recording import read_records
    from hil.report.comparison import compare_record, comparison_text
    from hil.report.comparison_html import comparison_page
    from hil.report.comparison_text import comparison_summary
    from hil.report.outputs import publish, require_folder

    if out is not None:
        require_folder(out)
    file = read_model_for_recordings(model, trust_laws)
    records = read_records(recordings, file.signals, file.on_bench, dbc, tell)
    comparisons = [compare_record(file.model, record) for record in records]
    text = comparison_text(comparisons)
    if out is not None:
        page = comparison_page(model.name, file.model.motion, comparisons)
        publish(
            out,
            {
                "compare.json": lambda path: path.write_text(text, encoding="utf-8"),
                "compare.html": lambda path: path.write_text(page, encoding="utf-8"),
            },
        )
    if as_json:
        typer.echo(text, nl=False)
    else:
        Console().print(comparison_summary(comparisons))
        if out is not None:
            typer.echo(f"plots: {out / 'compare.html'}")
