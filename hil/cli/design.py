"""``hil design``: the next experiment that would decide what recordings leave open."""

from __future__ import annotations

import json
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from drivers.foreign_file import read_regular_text
from hil.cli.diagnose import Effort, progress_bar
from hil.cli.options import Jobs, TrustLaws, tell
from hil.cli.printing import say

app = typer.Typer(add_completion=False)


class DesignFor(Enum):
    """What the next experiment is for."""

    DECIDE = "decide"
    PARAMETERS = "parameters"


@app.command(epilog="Example: hil design cruise.csv --model bus.toml --rig examples/rig.toml --out next.toml")
def design(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC", help="Recordings of the rig so far.")],
    model: Annotated[Path, typer.Option("--model", metavar="MODEL", help="Model file of the driveline.")],
    rig: Annotated[Path, typer.Option("--rig", metavar="RIG", help="Rig file: what may be driven.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="TOML", help="File for the experiment; its picture goes next to it, .png.")
    ],
    aim: Annotated[
        DesignFor, typer.Option("--for", help="Decide between explanations, or make the values better known.")
    ] = DesignFor.DECIDE,
    effort: Annotated[
        Effort, typer.Option("--effort", help="Work the search may cost, the same on every machine.")
    ] = Effort.NORMAL,
    trust_laws: TrustLaws = False,
    jobs: Jobs = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the design as JSON.")] = False,
) -> None:
    """Find the experiment, among those that the rig may drive, that tells most about what is left open.

    Every one is driven on paper by the most probable explanation, through the torque guard and within the rig file's
    [design]; how well it distinguishes explanations is the distance of what each would let the sensor read, in units of
    its noise. Writes TOML, which hil run drives, unless nothing is open or nothing that may be driven would tell.
    """
    from estimator.design.left_open import left_open
    from hil.config.model_file import read_model_for_recordings
    from hil.config.rig_file import read_rig
    from hil.design.design import Aim, designed, is_needed
    from hil.design.inputs import require_of_rig
    from hil.design.report import design_document, design_lines, design_toml, draw, question_lines
    from hil.orders.order import RigSource
    from hil.recording import read_records
    from hil.result_folder import publish, require_folder

    require_folder(out.parent)
    read_rig(rig)  # names every fault of the file by the line
    source = RigSource(rig, read_regular_text(rig))
    file = read_model_for_recordings(model, trust_laws)
    records = read_records(recordings, file.signals, file.on_bench, None, tell)
    require_of_rig(recordings, records, source.rig())
    wanted = Aim(aim.value)
    with progress_bar() as progress:
        known, _ = left_open(records, file.model, effort.value, progress)
        found = designed(source, known, wanted, progress) if is_needed(known, wanted) else None
    if found is not None and found.is_worth_driving:
        text, picture = design_toml(found, rig), out.with_suffix(".png").name
        publish(
            out.parent,
            {
                out.name: lambda path: path.write_text(text, encoding="utf-8"),
                picture: lambda path: draw(found.planned, path),
            },
        )
    if as_json:
        say(json.dumps(design_document(known, found, wanted)))
        return
    for line in [*question_lines(known), *(() if found is None else design_lines(known, found))]:
        say(line)
    if found is not None and found.is_worth_driving:
        say(f"{out}: hil run {rig} {out} --out {found.key}.csv drives it; {out.with_suffix('.png')} shows it")
