"""``--trust-laws`` of the commands that read a model file: whether the code its ``[laws]`` name may run."""

from __future__ import annotations

from typing import Annotated

import typer

TrustLaws = Annotated[
    bool,
    typer.Option(
        "--trust-laws", help=r"Run the Python code that \[laws] of the model file name; without it they are refused."
    ),
]
