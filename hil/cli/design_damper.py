"""``hil design damper``: a feedback from speed to torque that damps the resonance."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.options import tell
from hil.cli.printing import say

app = typer.Typer(add_completion=False)

ESTIMATE = "diagnosis.json or identification.json: its 95 % region in place of the model's tolerances."


@app.command(epilog="Example: hil design damper --model bus.toml --rig examples/rig.toml --out damper")
def damper(
    model: Annotated[Path, typer.Option(metavar="MODEL", help="Model file of a two-mass line.")],
    rig: Annotated[Path | None, typer.Option(metavar="RIG", help="Rig file: period, PRBS and torque limits.")] = None,
    target: Annotated[
        float, typer.Option(min=0.01, max=0.9, metavar="DAMPING", help="Least damping ratio of every line.")
    ] = 0.3,
    estimate: Annotated[Path | None, typer.Option(metavar="JSON", help=ESTIMATE)] = None,
    recording: Annotated[
        Path | None, typer.Option(metavar="REC", help="A run of this rig: the dead time of bus and inverters.")
    ] = None,
    check: Annotated[
        Path | None,
        typer.Option(metavar="JSON", help="What hil check --prove-stop --out kept: the dead time of both inverters."),
    ] = None,
    share: Annotated[
        float, typer.Option(min=0.01, max=1.0, help="Share of both torque limits that it may take.")
    ] = 0.25,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for damper.toml and pictures.")] = Path("damper"),
    as_json: Annotated[bool, typer.Option("--json", help="Print the design as JSON.")] = False,
) -> None:
    """Design active damping that reaches the target for every line that the estimate leaves possible.

    Sensitivity peaks at most at 2, and the rig's PRBS asks no more torque than the share. Refused, with what is in the
    way, where there is no such feedback. hil run --damper drives it, hil export damper writes it for a PLC.
    """
    import json

    from estimator.damper import design_damper
    from hil.config.damper_file import damper_toml
    from hil.design.damper import asked, design_document, design_lines, draw, file_of, region_of, timing_of
    from hil.result_folder import publish, require_folder

    require_folder(out)
    order = asked(rig, target, share)
    region, known = region_of(model, estimate)
    found = design_damper(region, timing_of(known, order.period_s, recording, tell, check), order.demand)
    file = file_of(found, region, order, str(model))
    publish(
        out,
        {
            "damper.toml": lambda path: path.write_text(damper_toml(file), encoding="utf-8"),
            "damper.png": lambda path: draw(found, region, path),
        },
    )
    if as_json:
        say(json.dumps(design_document(file, found)))
        return
    for line in design_lines(file, found):
        say(line)
    drives = "needs --rig to be driven" if file.rig is None else "hil run RIG EXPERIMENT --damper drives it"
    say(f"{out / 'damper.toml'}: {drives}; {out / 'damper.png'} shows it")
