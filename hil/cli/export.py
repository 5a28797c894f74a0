"""``hil export``: the estimator for other machines."""

from __future__ import annotations

from pathlib import Path

import typer

app = typer.Typer(add_completion=False, no_args_is_help=True)


@app.callback(epilog="Example: hil export st identified/identification.json --run cruise --out estimator.st")
def export() -> None:
    """Write the on-line estimator for another machine."""


@app.command(epilog="Example: hil export st identified/identification.json --run cruise --out estimator.st")
def st(
    identification: Path | None = typer.Argument(
        None, metavar="[IDENTIFICATION]", help="identification.json of hil identify; without it --adaptive."
    ),
    out: Path = typer.Option(
        ..., "--out", metavar="FILE", help="Structured Text to write; replaced where it is there."
    ),
    run: str | None = typer.Option(None, "--run", metavar="NAME", help="Recording whose observation filter is taken."),
    adaptive: bool = typer.Option(
        False, "--adaptive", help="Let the filter follow the estimate (AFOLOE): where there is no batch model."
    ),
    cycle: float = typer.Option(0.01, "--cycle", metavar="SECONDS", help="Period of the PLC task that will call it."),
    profile: str = typer.Option(
        "decreasing_then_constant_trace",
        "--profile",
        metavar="PROFILE",
        help="Adaptation gain, NAME or NAME:k=v,...: decreasing_then_constant_trace (the paper's), decreasing_gain, "
        "constant_forgetting, variable_forgetting, variable_forgetting_then_constant_trace, constant_trace, "
        "constant_gain.",
    ),
    single: bool = typer.Option(False, "--single", help="32-bit REAL instead of 64-bit LREAL."),
) -> None:
    """Write the estimator with its settings as IEC 61131-3 Structured Text for the PLC.

    Three function blocks: FB_HilDecimator, FB_HilOefo, and FB_HilEstimator, which is the one to call.
    """
    from hil.export.command import written_estimator
    from hil.export.structured_text import Precision, structured_text
    from hil.report.outputs import publish

    estimator = written_estimator(identification, run, adaptive, cycle, profile)
    text = structured_text(estimator, Precision.SINGLE if single else Precision.DOUBLE)
    publish(out.parent, {out.name: lambda path: path.write_text(text, encoding="ascii")})
    orders = estimator.settings.orders
    typer.echo(f"{out}: {estimator.origin}; na {orders.na}, nb {orders.nb}, nk {orders.nk}; call FB_HilEstimator")
