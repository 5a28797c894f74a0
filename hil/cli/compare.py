"""``hil compare``: simulations against recordings, in figures and plots."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.options import Dbc, Mapped, TrustFmu, TrustLaws, hold, tell
from hil.cli.printing import new_console, say

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil compare bus.toml run_1.csv run_2.csv --model out/augmented.toml --out comparison")
def compare(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Model file, nominal or augmented, or an FMU.")],
    recordings: Annotated[list[Path], typer.Argument(metavar="REC", help="Recordings to compare with.")],
    more: Annotated[
        list[Path] | None,
        typer.Option("--model", metavar="MODEL", help="A further model in the same plots; may be given several times."),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for compare.html and compare.json.")] = None,
    mapped: Mapped = None,
    trust_fmu: TrustFmu = False,
    dbc: Dbc = None,
    trust_laws: TrustLaws = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Simulate each recording from its torques and say how far the output is off.

    Only initial state and constant load torque are estimated; the model's parameters stay as they are. Recordings are
    prepared as the diagnosis did that wrote the model.
    """
    from hil.plants.plant import Trust
    from hil.provenance import provenance
    from hil.report.comparison import compared, comparison_text
    from hil.report.comparison_html import comparison_page, comparison_summary
    from hil.result_folder import publish

    if out is not None:
        hold(out)
    models = [model, *(more or ())]
    comparisons = compared(models, recordings, mapped or (), Trust(trust_laws, trust_fmu), dbc, tell)
    made = provenance(models, recordings)
    text = comparison_text(comparisons, made)
    if out is not None:
        page = comparison_page(comparisons, made)
        publish(
            out,
            {
                "compare.json": lambda path: path.write_text(text, encoding="utf-8"),
                "compare.html": lambda path: path.write_text(page, encoding="utf-8"),
            },
        )
    if as_json:
        say(text, nl=False)
    else:
        new_console().print(comparison_summary(comparisons))
        if out is not None:
            say(f"plots: {out / 'compare.html'}")
