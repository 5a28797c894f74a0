"""A dataset of a fleet without its recordings: rows of the right shape, of any number."""

from pathlib import Path

import numpy as np

from hil.fleet.dataset import DatasetRow, Writer

RESONANCE_HZ, BETWEEN_HZ, WITHIN_HZ = 8.2, 0.08, 0.12
OUTLIER, CHANGED = 3, 7
"""The bus whose resonance is a tenth lower than that of the others, and the one where it falls in the middle."""


def write_fleet(folder: Path, vehicles: int, drives: int, seed: int = 57) -> None:
    """Write verdicts of so many buses and drives; every ninth bus has a gap from its fourth drive on."""
    rng = np.random.default_rng(seed)
    writer = Writer(folder, "diagnose")
    for vehicle in range(vehicles):
        usual_hz = RESONANCE_HZ + rng.normal(0.0, BETWEEN_HZ)
        for drive in range(drives):
            weak = vehicle == OUTLIER or (vehicle == CHANGED and drive >= drives // 2)
            hz = (usual_hz + rng.normal(0.0, WITHIN_HZ)) * (0.9 if weak else 1.0)
            has_gap = vehicle % 9 == 0 and drive >= 3
            writer.add(_rows(vehicle, drive, hz, has_gap, float(rng.normal(0.02, 0.001))), "{}\n")
    writer.fail({"key": "", "name": "cut.csv", "url": "drives/cut.csv", "vehicle": "bus_1", "error": "no samples"})
    writer.finish()


def _rows(vehicle: int, drive: int, hz: float, has_gap: bool, gap_rad: float) -> dict[str, list[DatasetRow]]:
    key = f"{vehicle:06d}{drive:06d}"
    started = f"2026-{1 + drive // 28 % 12:02d}-{1 + drive % 28:02d}T08:00:00+00:00"
    of = {"key": key, "vehicle": f"bus_{vehicle}", "rig": "", "started": started, "name": f"drive_{drive}.parquet"}
    recording = {
        **of,
        "url": f"drives/bus_{vehicle}/drive_{drive}.parquet",
        "sha256": key,
        "n_recordings": 1,
        "n_samples": 3000,
        "duration_s": 30.0,
        "verdict": "explained" if has_gap else "no_mismatch",
        "statement": "The gap in the shaft explains what the model left." if has_gap else "Nothing is missing.",
        "element": "shaft" if has_gap else "",
        "effects": "backlash" if has_gap else "",
        "frequency_hz": hz,
        "damping": 0.057 * hz / RESONANCE_HZ,
        "model": "bus.toml",
        "model_sha256": "0",
        "from_fleet": "",
        "seconds": 1.0 + drive,
        "version": "0",
    }
    parameters: list[DatasetRow] = []
    effects: list[DatasetRow] = []
    if has_gap:
        effects = [{**of, "effect": "backlash", "form": "", "element": "shaft", "probability": 0.999, "share": 0.94}]
        low, high = 0.95 * gap_rad, 1.05 * gap_rad
        gap = {"effect": "backlash", "parameter": "gap_rad", "value": gap_rad, "low": low, "high": high, "unit": "rad"}
        parameters.append({**of, **gap})
    return {"recordings": [recording], "effects": effects, "parameters": parameters}
