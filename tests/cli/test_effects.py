"""``hil effects``: the catalogue on the terminal and for scripts."""

import re

import pytest

from estimator.physics.catalogue import EFFECTS
from hil.cli.main import run


def test_every_effect_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects"]) == 0
    out = capsys.readouterr().out
    assert [name for name in EFFECTS if name not in out] == []


@pytest.mark.parametrize("name", EFFECTS)
def test_one_effect_is_reported_in_full(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    assert run(["effects", name]) == 0
    out = capsys.readouterr().out
    entry = EFFECTS[name]
    reported = [name, entry.title, entry.law, entry.excited_by, entry.source, *entry.resembles, *entry.equivalent]
    for parameter in entry.parameters:
        reported += [parameter.name, parameter.meaning]
    assert [text for text in reported if text not in out] == []


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("backlash", [["gap_rad", "rad or m", "0", "0 to 20 scales", "total gap"]]),
        ("torque_saturation", [["limit_sum_nm", "Nm or N", "∞", "0.05 to 1.2 scales", "limit of the sum: L"]]),
        (
            "brake_drag",
            [
                ["brake_nm", "Nm or N", "0", "0 to 60 scales", "braking torque T_B"],
                ["to_s", "s", "0", "in the recording", "moment it ends: t_2, of each recording"],
            ],
        ),
        ("load_imbalance", [["phase_rad", "rad", "0", "-10 to 10", "phase alpha, of each recording"]]),
        ("clock_drift", [["rate", "–", "0", "-20 to 20 scales", "relative difference of the rates: r"]]),
        ("road_grade", [["grade_rms_nm", "Nm or N", "0", "free", "size of the profile: its rms"]]),
        ("stale_samples", [["share", "–", "0", "read off the data", "share of stale rows"]]),
    ],
)
def test_a_parameter_is_reported_with_unit_null_bounds_and_meaning(
    name: str, rows: list[list[str]], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    assert run(["effects", name]) == 0
    table = [re.split(r" {2,}", line.strip()) for line in capsys.readouterr().out.splitlines()]
    for row in rows:
        assert row in table


def test_an_unknown_effect_is_refused_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "backlsh"]) == 2
    assert "Did you mean backlash?" in capsys.readouterr().err
