"""What ``hil export st`` and ``hil export plcopen`` ask for, put together from their arguments."""

from __future__ import annotations

from pathlib import Path

from estimator.identification.settings import Settings
from hil.errors import UsageError
from hil.export.identification_file import plc_estimator
from hil.export.plc_estimator import PlcEstimator
from hil.export.profiles import profile as read_profile


def written_estimator(
    identification: Path | None, run: str | None, adaptive: bool, cycle_s: float, profile: str
) -> PlcEstimator:
    """Return the estimator that the arguments of a command describe."""
    adaptation = read_profile(profile)
    if identification is not None:
        return plc_estimator(identification, run, cycle_s, adaptation, adaptive)
    if run is not None:
        raise UsageError(f"--run {run}: expected the identification.json that holds it, got no file")
    if not adaptive:
        raise UsageError(
            "expected identification.json, whose model gives the observation filter, got no file. Make it by: hil "
            "identify; or let the filter follow the estimate: --adaptive"
        )
    return PlcEstimator(Settings(adaptation=adaptation), cycle_s, None, "the defaults, filter adapted on line")
