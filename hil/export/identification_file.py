"""The estimator of a PLC with what identified a recording."""

from __future__ import annotations

from pathlib import Path

from estimator.errors import BadModel, BadSetting
from estimator.identification.online.adaptation import Adaptation
from hil.errors import FileProblem
from hil.export.plc_estimator import PlcEstimator
from hil.report.identification_input import identified


def plc_estimator(
    path: Path, run: str | None, cycle_s: float, adaptation: Adaptation, adaptive: bool = False
) -> PlcEstimator:
    """Return the estimator with the settings and the filter that identified a recording.

    Parameters
    ----------
    path : Path
        ``identification.json``.
    run : str or None
        Name of the recording; None where the file has one alone.
    cycle_s : float
        Period of the PLC task [s].
    adaptation : Adaptation
        Adaptation-gain profile.
    adaptive : bool
        Take the settings alone: the filter follows the estimate.

    Raises
    ------
    UsageError
        If the recording is not in the file, or none is named and there are several.
    FileProblem
        If the file is wrong, its filter could not filter, or its settings suit no PLC, or not that period.
    """
    found = identified(path, run, adaptation)
    origin = f"{path.name}, recording {found.name}"
    try:
        return PlcEstimator(found.settings, cycle_s, None if adaptive else found.L, origin)
    except BadModel as cause:
        raise FileProblem(path, f"recordings.{found.name}.filter_L | {cause}") from cause
    except BadSetting as cause:
        raise FileProblem(path, f"settings | {cause}") from cause
