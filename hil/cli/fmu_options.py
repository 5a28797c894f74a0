"""``--map`` and ``--trust-fmu`` of the commands that take an FMU: which of its variables are what, and may it run."""

from __future__ import annotations

from typing import Annotated

import typer

Mapped = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="KEY=NAME,...",
        help="Variables of an FMU: torque=T1,T2 (one: their sum), output=w, load=T_L and start=w0,... (estimated).",
    ),
]

TrustFmu = Annotated[bool, typer.Option("--trust-fmu", help="Run the program in an FMU; without it FMUs are refused.")]
