"""The options of ``hil commission``, each with what its help says."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RigFile = Annotated[Path, typer.Argument(metavar="RIG", help="Rig file.")]
Folder = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder of this commissioning; it is resumed there.")
]
DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Print the plan: steps, torques, time; opens no bus, writes nothing.")
]
Yes = Annotated[bool, typer.Option("--yes", help="Command torque without asking; for scripts.")]
Skip = Annotated[list[str] | None, typer.Option(metavar="STEP", help="Skip a step; may be repeated. Needs --because.")]
Because = Annotated[
    list[str] | None,
    typer.Option(metavar="TEXT", help="Why it is skipped, one for each --skip or one for all; it is recorded."),
]
Repeat = Annotated[
    list[str] | None, typer.Option(metavar="STEP", help="Do a step again that is done; may be repeated.")
]
KeepResults = Annotated[
    str, typer.Option(metavar="TEXT", help="After a change of the rig file: why results from before it are kept.")
]
Model = Annotated[
    Path | None,
    typer.Option(metavar="MODEL", help="Model file for predictions and the diagnosis; else one is made."),
]
Travel = Annotated[
    float | None,
    typer.Option(metavar="M_PER_RAD", min=1e-6, help="Distance of the vehicle in metres per radian of the shaft."),
]
Bus = Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")]
Modbus = Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON, progress on standard error.")]
