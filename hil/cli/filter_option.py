"""``--filter`` of the commands that estimate on line: the observation filter L from a batch model of an earlier run.

As in the paper (equation 7). Without it the filter follows the estimate.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.errors import UsageError

if TYPE_CHECKING:
    from estimator.identification.settings import Settings
    from hil.rig.live import OnlineSetup

FilterOf = Annotated[
    Path | None,
    typer.Option(
        "--filter",
        metavar="FILE",
        help="identification.json of an earlier run: its orders, and its off-line model as the fixed filter.",
    ),
]
FilterRun = Annotated[
    str | None, typer.Option("--filter-run", metavar="NAME", help="Which recording of that file, if it has several.")
]


def with_filter(settings: Settings, path: Path | None, run: str | None) -> OnlineSetup:
    """Return settings with what identified an earlier run, and its filter L; as they are without a file."""
    from hil.rig.live import OnlineSetup

    if path is None:
        if run is not None:
            raise UsageError(f"--filter-run {run}: expected --filter FILE with it, got none")
        return OnlineSetup(settings)
    from hil.report.identification_input import identified

    found = identified(path, run, settings.adaptation, "--filter-run")
    return OnlineSetup(replace(found.settings, band_hz=settings.band_hz), found.L)
