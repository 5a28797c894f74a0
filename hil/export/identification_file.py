"""The estimator of a PLC with what identified a recording."""

from __future__ import annotations

from pathlib import Path

from estimator.errors import BadModel, BadSetting
from estimator.identification.online.adaptation import Adaptation
from hil.errors import FileProblem
from hil.export.plc_estimator import PlcEstimator
from hil.report.identification.read_back import identified


def plc_estimator(
    path: Path, run: str | None, cycle_s: float, adaptation: Adaptation, adaptive: bool = False
) -> PlcEstimator:
    """Return the estimator with the settings and the filter that identified a recording."""
    found = identified(path, run, adaptation)
    origin = f"{path.name}, recording {found.name}"
    try:
        return PlcEstimator(found.settings, cycle_s, None if adaptive else found.L, origin)
    except BadModel as cause:
        raise FileProblem(path, f"recordings.{found.name}.filter_L | {cause}") from cause
    except BadSetting as cause:
        raise FileProblem(path, f"settings | {cause}") from cause
