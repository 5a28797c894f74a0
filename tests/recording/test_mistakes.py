"""Mistakes of people who bring a recording: none has a wrong cure or goes without a word, most have the right one."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from hil.plants.scales import tell_doubts
from hil.recording import SignalsConfig, read_record
from tests.campaigns.mistakes import BUS_NOMINAL, MISTAKES, RIG_NOMINAL, SIGNALS, csv, driven, judge
from tests.estimator.physics.bench import model, scaled

LEAST_RIGHT = 0.8
"""Share of the mistakes; what else is listed has others that fit as well."""


@pytest.mark.campaign
def test_no_mistake_has_a_wrong_cure_or_goes_without_a_word(tmp_path: Path) -> None:
    came = {name: judge(mistake, tmp_path).kind for name, mistake in MISTAKES.items()}
    counts = Counter(came.values())
    assert {name: kind for name, kind in came.items() if kind not in ("right", "named")} == {}
    assert counts["right"] >= LEAST_RIGHT * len(came)


@pytest.mark.parametrize("of", ["tip", "cruise", "back", "rig"])
def test_of_a_recording_that_is_right_nothing_is_said(of: str, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(csv({name: driven(of)[name] for name in ("t", "T1", "T2", "n")}), "utf-8")
    said: list[str] = []
    signals = SignalsConfig.model_validate(SIGNALS)
    record = read_record(path, signals, tell=said.append)
    nominal = RIG_NOMINAL if of == "rig" else BUS_NOMINAL
    tell_doubts([record], [path], model(nominal), signals, None, said.append)
    assert said == []


def test_a_payload_of_the_vehicle_again_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(csv({name: driven("tip")[name] for name in ("t", "T1", "T2", "n")}), "utf-8")
    said: list[str] = []
    signals = SignalsConfig.model_validate(SIGNALS)
    tell_doubts([read_record(path, signals)], [path], model(scaled(BUS_NOMINAL, J_L=0.5)), signals, None, said.append)
    assert said == []
