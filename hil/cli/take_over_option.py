"""The option of the commands that use a rig's bus: put up with another host whose drives are disabled."""

from __future__ import annotations

from typing import Annotated

import typer

TakeOver = Annotated[
    bool,
    typer.Option(
        "--take-over", help="Continue though another host is heard on the bus; refused where a drive may carry torque."
    ),
]
