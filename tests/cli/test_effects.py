"""``hil effects``: the catalogue on the terminal and for scripts."""

import json
import re

import pytest

from estimator.physics.catalogue import EFFECTS
from hil.cli.main import run


def test_every_effect_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects"]) == 0
    out = capsys.readouterr().out
    assert [name for name in EFFECTS if name not in out] == []


def test_every_effect_is_listed_for_scripts(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in content["effects"]] == list(EFFECTS)


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


def test_scripts_get_bounds_and_whose_a_parameter_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "brake_drag", "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["effects"]
    brake, begin = entry["parameters"]["brake_nm"], entry["parameters"]["from_s"]
    assert (brake["bounds_in_scales"], brake["optional"], brake["per_recording"]) == ([0.0, 60.0], False, False)
    assert (begin["bounds_in_scales"], begin["optional"], begin["per_recording"]) == ([0.0, None], True, True)
    assert entry["resembles"] == list(EFFECTS["brake_drag"].resembles)


def test_an_unknown_effect_is_refused_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "backlsh"]) == 2
    assert "Did you mean backlash?" in capsys.readouterr().err
