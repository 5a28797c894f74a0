"""Further measured outputs and a measured load torque: each column has one role."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from estimator.errors import Cure, Implausible
from estimator.signals.record import Location, OutputKind
from hil.plants.scales import cure_lines, with_the_line_to_write
from hil.problems import problem_lines
from hil.recording import SignalsConfig, Table, write_table
from hil.recording.signals import to_record

Changed = Callable[..., Table]


def signals(**keys: Any) -> SignalsConfig:
    return SignalsConfig.model_validate(keys)


BOTH = [
    {"kind": "speed", "at": "motor", "column": "speed_rad_s"},
    {"kind": "torque", "at": "shaft", "column": "torque_ref_nm", "scale": 2.0},
]


def test_the_first_speed_is_the_output_and_the_others_are_further_ones(changed: Changed) -> None:
    torque = np.arange(40.0)
    torque[7] = np.nan
    record = to_record(changed(torque_ref_nm=torque), signals(outputs=BOTH))
    assert (record.kind, record.location) == (OutputKind.SPEED, Location.MOTOR)
    (channel,) = record.channels
    assert (channel.label, channel.kind, channel.location) == ("torque_ref_nm", OutputKind.TORQUE, Location.SHAFT)
    np.testing.assert_array_equal(channel.output, 2.0 * torque)
    assert np.flatnonzero(~channel.okay).tolist() == [7]
    assert record.okay.all()  # a reading that is missing elsewhere is missing there alone


@pytest.mark.parametrize(
    ("keys", "first", "further"),
    [
        ({"outputs": BOTH[1:]}, "speed_rad_s", ["torque_ref_nm"]),  # next to the contract's motor speed
        ({"outputs": BOTH, "position": {"column": "age_s"}}, "age_s", ["speed_rad_s", "torque_ref_nm"]),
        ({"outputs": BOTH, "speed": {"column": "speed_rad_s"}}, "speed_rad_s", ["torque_ref_nm"]),
    ],
)
def test_each_column_has_one_role(keys: dict[str, Any], first: str, further: list[str]) -> None:
    config = signals(**keys)
    assert config.output()[1].column == first
    assert [each.column for each in config.further()] == further
    assert set(config.columns()) >= {first, *further}


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"outputs": [{"kind": "speed", "at": "shaft", "column": "w"}]}, "speed at the shaft"),
        ({"outputs": [{"kind": "torque", "at": "motor", "column": "T"}]}, "torque at the motor"),
        ({"outputs": [{"kind": "force", "at": "load", "column": "F"}]}, "force at the load"),
        ({"outputs": [BOTH[1]], "torque": [{"column": "T"}]}, "a speed or a position among them"),
    ],
)
def test_outputs_that_no_structure_has_are_refused(keys: dict[str, Any], expected: str) -> None:
    with pytest.raises(ValidationError) as caught:
        signals(**keys)
    (line,) = problem_lines(SignalsConfig, caught.value)
    assert expected in line


@pytest.mark.parametrize(
    ("keys", "number", "other"),
    [
        ({"outputs": [*BOTH, BOTH[1]]}, 2, "outputs.1"),
        ({"outputs": [*BOTH, {**BOTH[1], "at": "load", "scale": 1.0}]}, 2, "outputs.1"),
        ({"outputs": BOTH, "torque": [{"column": "torque_ref_nm"}]}, 1, "the inputs"),
        ({"outputs": [BOTH[0], {**BOTH[1], "column": "torque_m1_nm"}]}, 1, "the inputs"),
        ({"outputs": BOTH, "load": {"column": "torque_ref_nm"}}, 1, "the inputs"),
    ],
)
def test_an_output_with_a_column_that_is_another_signals_is_refused(
    keys: dict[str, Any], number: int, other: str
) -> None:
    with pytest.raises(ValidationError) as caught:
        signals(**keys)
    (line,) = problem_lines(SignalsConfig, caught.value)
    expected = f"a column of its own, another than that of {other}"
    assert line.startswith(f"outputs.{number}.column | expected {expected} | got")


LOAD = {"load": {"column": "torque_ref_nm", "scale": -2.0}}


def test_a_measured_load_torque_is_an_input(changed: Changed) -> None:
    read = np.linspace(1.0, 9.0, 40)
    read[[0, 7]] = np.nan
    record = to_record(changed(torque_ref_nm=read), signals(**LOAD))
    due = -2.0 * read
    due[[0, 7]] = due[[1, 6]]  # held, at the start the first one
    np.testing.assert_array_equal(record.known_load_nm, due)
    assert np.flatnonzero(~record.okay).tolist() == [0, 7]
    assert record.torque_okay is None
    assert to_record(changed(), SignalsConfig()).known_load_nm == 0.0


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
