"""``hil effects``: the catalogue on the terminal and for scripts."""

from __future__ import annotations

import json

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


def test_one_effect_is_told_in_full(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "backlash"]) == 0
    out = capsys.readouterr().out
    assert "gap_rad" in out
    assert "excited by" in out


def test_an_unknown_effect_is_refused_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "backlsh"]) == 2
    assert "Did you mean backlash?" in capsys.readouterr().err


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "--help"]) == 0
    assert "hil effects backlash" in capsys.readouterr().out
