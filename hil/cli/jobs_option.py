"""On how many cores is computed: ``HIL_JOBS`` for every command, ``--jobs`` of those that take long.

Without either, on all that the process may use. The results are the same, bit for bit.
"""

from __future__ import annotations

import os
from typing import Annotated

import typer

from hil.errors import UsageError

VARIABLE = "HIL_JOBS"


def use_cores(count: int | None) -> None:
    """Compute on so many cores; None leaves it as it is."""
    from estimator.physics.parallel import work_on

    if count is not None:
        work_on(count)


def use_cores_of_environment() -> None:
    """Compute on as many cores as ``HIL_JOBS`` says, where it is set.

    Raises
    ------
    UsageError
        If it is no whole number from 1 on.
    """
    text = os.environ.get(VARIABLE, "").strip()
    if not text:
        return
    if not text.isdecimal() or int(text) < 1:
        raise UsageError(f"{VARIABLE}: expected a whole number from 1 on, got {text!r}. Correct or unset it.")
    use_cores(int(text))


Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        min=1,
        metavar="N",
        help="Cores to compute on; all by default, or as many as HIL_JOBS says.",
        callback=use_cores,
    ),
]
