"""How often a diagnosis of simulated worlds is right: the cases, the files, and the table."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hil.config.model_file import read_model
from hil.proof.truth.dirty import Known
from hil.proof.worlds import KINDS, NOTHING, OUTSIDE, STRONG, _stated, case_of, knows, main, table

ROWS = [
    {
        "set": "dirty",
        "seed": 1,
        "strong": "backlash",
        "strong_named": True,
        "named": ["backlash", "tyre_slip"],
        "false": ["tyre_slip"],
        "probability": {"backlash": 0.99, "tyre_slip": 0.95},
        "alike": {"backlash": ["stiffness_nonlinearity"], "tyre_slip": []},
        "untestable": ["gravity", "grounded_spring"],
        "time_s": 5.0,
        "cpu_s": 7.0,
    },
    {
        "set": "dirty",
        "seed": 2,
        "strong": NOTHING,
        "strong_named": False,
        "named": [],
        "false": [],
        "probability": {},
        "time_s": 4.0,
        "cpu_s": 6.0,
    },
]


def test_the_table_counts_what_was_named_and_what_is_not_there() -> None:
    assert table(ROWS).splitlines()[2] == "| dirty, 1 | 2 | 1 of 1 | 2 | 1 | 1 | 1 of 2 | 1 | 2 | 5.0, 5.0 | 7.0, 7.0 |"


def test_what_is_answered_is_not_answered_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "dirty.jsonl").write_text("".join(json.dumps(row) + "\n" for row in ROWS))
    assert main(["--set", "dirty", "--seeds", "1..2", "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out == table(ROWS)


@pytest.mark.parametrize(("which", "seed"), [("clean", 1), ("clean", 9), ("dirty", 3), ("quiet", 5), ("outside", 2)])
def test_a_set_conceals_what_it_says(which: str, seed: int) -> None:
    case, known, strong = case_of(which, seed)
    expected = {"clean": NOTHING if seed % 9 == 0 else KINDS[seed % len(KINDS)], "quiet": NOTHING}
    expected["outside"] = OUTSIDE[seed % len(OUTSIDE)]
    assert strong == expected.get(which, STRONG[seed % len(STRONG)])
    assert set(known) <= set(case.specimen.sizes)
    assert bool(known) <= (which in ("dirty", "quiet") and knows(seed) is not Known.NONE)


@pytest.mark.parametrize("tolerance", [0.0, 0.2])
def test_what_is_known_is_read_as_it_was_stated(tmp_path: Path, tolerance: float) -> None:
    line = 'schema = "hil.model/1"\nstructure = "one_mass"\n[parameters]\nJ_M = { value = 1, tolerance = 0.2 }\n'
    text = (
        line + "b_M = { value = 1, tolerance = 0.2 }\n" + _stated("actuator_lag", {"time_constant_s": 0.003}, tolerance)
    )
    (tmp_path / "model.toml").write_text(text)
    value = read_model(tmp_path / "model.toml").model.effects["actuator_lag"]["time_constant_s"]
    assert (value.value, value.tolerance) == (0.003, tolerance)
