"""``hil compare``: simulations against recordings, in figures and plots."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.options import Dbc, Mapped, TrustFmu, TrustLaws, hold, tell
from hil.cli.printing import new_console, say

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil compare bus.toml out/augmented.toml run_1.csv run_2.csv --out comparison")
def compare(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="MODEL... REC...",
            help="Model files, nominal or augmented, or FMUs, side by side; then the recordings to compare with.",
        ),
    ],
    more: Annotated[
        list[Path] | None,
        typer.Option("--model", metavar="MODEL", help="A further model; may be given several times."),
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
    from hil.errors import UsageError
    from hil.plants.fmu_plant import is_fmu
    from hil.plants.plant import Trust
    from hil.provenance import provenance
    from hil.report.comparison import compared, comparison_text
    from hil.report.comparison_html import comparison_page, comparison_summary
    from hil.result_folder import publish

    def is_model(path: Path) -> bool:
        return path.suffix.lower() == ".toml" or is_fmu(path)

    if out is not None:
        hold(out)
    models = [*(path for path in files if is_model(path)), *(more or ())]
    recordings = [path for path in files if not is_model(path)]
    if not models or not recordings:
        got = f"{len(models)} and {len(recordings)}"
        raise UsageError(f"compare: expected at least one model (.toml or .fmu) and one recording, got {got}")
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
