"""What 32-bit arithmetic costs the exported estimator: ``python -m tests.benchmarks.plc_single``.

Simulated cruises go through the estimator of the host (64 bit) and through the exported text in single precision,
executed. Printed is the worst difference at the end of any of them.
"""

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from estimator.identification.identify import identify
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import resonance
from estimator.signals.record import FloatArray
from hil.export.plc_estimator import PlcEstimator
from hil.export.structured_text import Precision
from tests.estimator.identification.driveline import cruise
from tests.export.drives import clean_drive
from tests.export.plc_runs import on_host, on_plc

BAND_HZ = (2.0, 25.0)


@dataclass(frozen=True, slots=True)
class Difference:
    """Worst differences of single precision from double: theta, response [dB], frequency and damping (relative)."""

    theta: float
    response_db: float
    frequency: float
    damping: float


def difference(seed: int, duration_s: float, adapted: bool, folder: Path) -> Difference:
    """Run one drive through both and compare what they end at."""
    L = None if adapted else identify(cruise(seed, duration_s=duration_s).record).L
    estimator, drive = PlcEstimator(L=L), clean_drive(seed, duration_s)
    single = on_plc(estimator, drive, folder, Precision.SINGLE).theta[-1].astype(np.float64)
    double: FloatArray = on_host(estimator, drive).theta[-1]
    models = [
        LinearModel.from_theta(theta, estimator.settings.orders, estimator.settings.sample_time_s)
        for theta in (single, double)
    ]
    modes = [resonance(model, BAND_HZ) for model in models]
    if modes[0] is None or modes[1] is None:
        raise ValueError(f"seed {seed}: expected a resonance in {BAND_HZ} Hz, got none")
    gains = [np.abs(model.response(np.linspace(*BAND_HZ, 200))) for model in models]
    return Difference(
        theta=float(np.abs(single - double).max()),
        response_db=float(np.abs(20.0 * np.log10(gains[0] / gains[1])).max()),
        frequency=abs(modes[0].frequency_hz / modes[1].frequency_hz - 1.0),
        damping=abs(modes[0].damping / modes[1].damping - 1.0),
    )


def main() -> None:
    """Print one line per length of drive."""
    with tempfile.TemporaryDirectory() as folder:
        for duration_s, seeds in ((22.0, range(1, 9)), (600.0, range(1, 4))):
            found = [difference(seed, duration_s, adapted, Path(folder)) for seed in seeds for adapted in (False, True)]
            worst = {name: max(getattr(each, name) for each in found) for name in Difference.__slots__}
            text = ", ".join(f"{name} {value:.1e}" for name, value in worst.items())
            sys.stdout.write(f"{len(seeds)} drives of {duration_s:g} s, L fixed and adapted: {text}\n")


if __name__ == "__main__":
    main()
