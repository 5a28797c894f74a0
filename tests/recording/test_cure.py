"""The line that cures a wrong scale, over the scale that counts now."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimator.errors import Cure, Implausible
from hil.plants.scales import cure_lines, with_the_line_to_write
from hil.recording import SignalsConfig, Table, write_table

TABLE = Table(
    Path("run.csv"),
    {name: np.arange(20.0) for name in ("t", "T1", "T2", "n")},
    {"t": "s", "T1": "kNm", "T2": "kNm", "n": "1/min"},
)
SIGNALS: dict[str, Any] = {
    "time": {"column": "t"},
    "torque": [{"column": "T1"}, {"column": "T2", "scale": 5.0}],
    "speed": {"column": "n", "scale": 2.0},
}


@pytest.mark.parametrize(
    ("cure", "lines"),
    [
        (
            Cure("run", torque=0.6),
            ['torque = [ { column = "T1", scale = 600 }, { column = "T2", scale = 3 } ]'],
        ),
        (
            Cure("run", torque=-1.0, inputs=(1,)),
            ['torque = [ { column = "T1", scale = 1000 }, { column = "T2", scale = -5 } ]'],
        ),
        (Cure("run", output=0.5), ['speed = { column = "n", at = "motor" }']),
        (Cure("run", output=-1.0), ['speed = { column = "n", scale = -2, at = "motor" }']),
        (Cure("run", time=1e-3), ['time = { column = "t", scale = 0.001 }']),
        (
            Cure("run", swapped=1),
            ['torque = [ { column = "T1" }, { column = "n" } ]', 'speed = { column = "T2", at = "motor" }'],
        ),
    ],
)
def test_the_lines_are_those_to_write(cure: Cure, lines: list[str]) -> None:
    assert cure_lines(cure, SignalsConfig.model_validate(SIGNALS), TABLE) == lines


def test_the_line_is_a_note_of_the_refusal(tmp_path: Path) -> None:
    write_table(TABLE, tmp_path / "run.csv")
    signals = SignalsConfig.model_validate(SIGNALS)
    with pytest.raises(Implausible) as refusal, with_the_line_to_write([tmp_path / "run.csv"], signals):
        raise Implausible("recording run is implausible", Cure("run", torque=0.6))
    assert refusal.value.__notes__ == [
        'In [signals] write: torque = [ { column = "T1", scale = 600 }, { column = "T2", scale = 3 } ]'
    ]
