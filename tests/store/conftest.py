"""A folder of recordings that explain themselves."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hil.recording import Table, write_table
from hil.recording.checksum import text_sha256

RIG = 'schema = "hil.rig/1"\nname = "bench"\n'


N_ROWS = 50


@pytest.fixture
def record(tmp_path: Path) -> Callable[..., Path]:
    """Write a recording of a run; its samples follow from its name."""

    def write(
        name: str, experiment: str = "cruise", started: str = "2026-11-21T10:00:00+00:00", rig: str = RIG
    ) -> Path:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        rng = np.random.default_rng(list(name.encode()))
        flags = np.zeros(N_ROWS, dtype=np.int64)
        flags[:3] = 4
        columns = {"time_s": 0.01 * np.arange(N_ROWS), "speed_rad_s": rng.normal(size=N_ROWS), "flags": flags}
        said = {
            "schema": "hil.recording/1",
            "experiment": experiment,
            "started_utc": started,
            "hil_version": "0.1.0",
            "rig_file": rig,
            "rig_sha256": text_sha256(rig),
            "eds_m1_sha256": "ab" * 32,
            "pace": "fast",
        }
        write_table(Table(path, columns, {"time_s": "s"}, said), path)
        return path

    return write
