"""A power study from its command to its summary, and the fit of its curve."""

import json
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from scipy import special

from hil.proof.campaign import case as campaign_case
from hil.proof.command import CommandFailed
from hil.proof.power import run as power
from hil.proof.power.fit import fit_curve

FRICTION = {"name": "coulomb_friction_motor", "element": "motor", "indistinguishable_from": [], "time_s": {}}
SHORT = ["--effects", "coulomb_friction_motor", "--duration-s", "2"]


class Tool:
    """Stands for the command line: finds the friction whenever it is asked for an odd time."""

    def __init__(self):
        self.asked = 0

    def __call__(self, arguments, folder, limit_s):
        assert arguments[0] == "diagnose"  # there are no fresh recordings to simulate
        self.asked += 1
        found = self.asked % 2 == 1
        diagnosis = {
            "verdict": "explained" if found else "no_mismatch",
            "mismatch": {"element": "motor" if found else None},
            "effects": [{**FRICTION, "parameters": {}}] if found else [],
            "parameters": {},
            "fit": {"noise_floor": 0.05},
        }
        out = Path(folder).parent / "out"
        out.mkdir()
        (out / "diagnosis.json").write_text(json.dumps(diagnosis))


@pytest.fixture
def tool(monkeypatch, brief):
    tool = Tool()
    monkeypatch.setattr(campaign_case, "run_hil", tool)
    return tool


def _rows(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_a_study_continues_where_it_ended_and_says_what_it_adds_up_to(tool, tmp_path, capsys):
    arguments = [*SHORT, "--out", str(tmp_path), "--seeds", "1"]
    assert power.main([*arguments, "--multiples", "1,2"]) == 0
    assert power.main([*arguments, "--multiples", "1,2,3"]) == 0
    assert "1 trials to run, 2 done before" in capsys.readouterr().out
    rows = _rows(tmp_path / "results.jsonl")
    assert [row["multiple"] for row in rows] == [1.0, 2.0, 3.0]
    assert [row["found"] for row in rows] == [True, False, True]
    bound = _rows(tmp_path / "bounds.jsonl")[-1]["bound"]
    assert rows[1]["size"] == pytest.approx(2.0 * bound["recorded"])
    assert rows[1]["over"]["known"] == pytest.approx(2.0 * bound["recorded"] / bound["known"])
    figures = json.loads((tmp_path / "summary.json").read_text())["effects"]["coulomb_friction_motor"]
    assert [(p["multiple"], p["hits"], p["trials"]) for p in figures["points"]] == [(1, 1, 1), (2, 0, 1), (3, 1, 1)]
    assert figures["points"][0]["best"]["recorded"] == pytest.approx(0.9, abs=0.01)
    assert figures["outcomes"] == {"right": 2, "missed": 1}
    assert "| `coulomb_friction_motor` | 2 | 0 of 1 |" in (tmp_path / "summary.md").read_text()
    circles = ET.parse(tmp_path / "power.svg").getroot().findall(".//{http://www.w3.org/2000/svg}circle")
    assert len(circles) == 3
    assert float(circles[1].get("cy")) > float(circles[0].get("cy"))  # what was not found is lower


def test_a_command_that_fails_is_reported_and_run_again(monkeypatch, tmp_path, tool):
    def broken(arguments, folder, limit_s):
        raise CommandFailed("hil diagnose: ended with status 3: no bus")

    arguments = [*SHORT, "--out", str(tmp_path), "--seeds", "1", "--multiples", "1"]
    with monkeypatch.context() as context:
        context.setattr(campaign_case, "run_hil", broken)
        assert power.main(arguments) == 0
    assert "no bus" in (tmp_path / "summary.md").read_text()
    assert json.loads((tmp_path / "summary.json").read_text())["effects"] == {}
    assert power.main(arguments) == 0
    assert [row["found"] for row in _rows(tmp_path / "results.jsonl")] == [False, True]
    assert json.loads((tmp_path / "summary.json").read_text())["trials"] == 1


def test_a_folder_of_another_study_is_refused(tool, tmp_path, capsys):
    arguments = [*SHORT, "--out", str(tmp_path), "--seeds", "1", "--multiples", "1"]
    assert power.main(arguments) == 0
    with pytest.raises(SystemExit) as exit_:
        power.main([*arguments, "--alpha", "0.01"])
    assert exit_.value.code == 2
    assert "Choose another folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (["--effects", "road_grade"], "single size"),
        (["--multiples", "1,x"], "numbers with commas"),
        (["--multiples", "0,1"], "0.001 or more"),
        (["--alpha", "1"], "between 0 and 1"),
        (["--duration-s", "40"], "1 to 30 s"),
        (["--jobs", "0"], "1 or more"),
        (["--seeds", "9..1"], "A..B"),
    ],
)
def test_wrong_use_is_refused_before_anything_is_made(tmp_path, capsys, wrong, said):
    with pytest.raises(SystemExit) as exit_:
        power.main(["--seeds", "1", *wrong, "--out", str(tmp_path / "out")])
    assert exit_.value.code == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.timeout(300)
@pytest.mark.campaign
def test_the_public_command_is_scored_by_the_verdict_it_wrote(tmp_path):
    """Three times the bound, recordings of 15 s: whether it is found is the tool's affair, not this test's."""
    wanted = ["--effects", "coulomb_friction_motor", "--seeds", "1", "--multiples", "3", "--duration-s", "15"]
    assert power.main([*wanted, "--out", str(tmp_path)]) == 0
    (row,) = _rows(tmp_path / "results.jsonl")
    case = tmp_path / "cases" / "coulomb_friction_motor" / "1" / "3"
    verdict = json.loads((case / "out" / "diagnosis.json").read_text())
    truth = json.loads((case / "sealed" / "truth.json").read_text())
    named = {name for e in verdict["effects"] for name in (e["name"], *e["indistinguishable_from"])}
    assert row["fault"] is None
    assert row["verdict"] == verdict["verdict"]
    assert row["found"] is (verdict["verdict"] == "explained" and "coulomb_friction_motor" in named)
    assert row["size"] == pytest.approx(truth["hidden"]["coulomb_friction_motor"]["coulomb_nm"])
    assert row["distance"]["recorded"] == pytest.approx(3.0 * 4.2367, rel=0.05)  # z for 0.05 / 32, and for 0.9
    assert len((case / "case" / "run_1.csv").read_text().splitlines()) == 1501


def test_a_curve_is_found_again_from_its_trials():
    rng = np.random.default_rng(3)
    sizes = np.repeat([0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0], 200)
    chance = special.expit(special.logit(0.9) + 8.0 * np.log(sizes / 1.3))
    curve = fit_curve(sizes.tolist(), (rng.random(sizes.size) < chance).tolist())
    assert curve.size == pytest.approx(1.3, rel=0.05)
    assert curve.steepness == pytest.approx(8.0, rel=0.2)
    assert curve.low < 1.3 < curve.high < 1.1 * curve.low * 1.1
    assert curve.power(curve.size) == pytest.approx(0.9)


def test_the_interval_holds_the_size_as_often_as_it_says():
    rng = np.random.default_rng(4)
    sizes = np.repeat([0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0], 8)
    chance = special.expit(special.logit(0.9) + 8.0 * np.log(sizes / 1.3))
    curves = [fit_curve(sizes.tolist(), (rng.random(sizes.size) < chance).tolist()) for _ in range(60)]
    held = np.mean([curve.low <= 1.3 <= curve.high for curve in curves])
    assert held >= 0.85  # four deviations of 60 draws below 0.95 are 0.84


def test_trials_that_a_size_separates_have_an_estimate_between():
    curve = fit_curve([1.0, 1.0, 2.0, 2.0, 4.0, 4.0], [False, False, False, False, True, True])
    assert 2.0 < curve.low * 2.0
    assert 2.0 < curve.size < 8.0


def test_what_was_never_or_always_found_has_no_size_between():
    never, always = fit_curve([1.0, 2.0], [False, False]), fit_curve([1.0, 2.0], [True, True])
    assert (never.size, never.high) == (math.inf, math.inf)
    assert (always.size, always.low) == (0.0, 0.0)
    assert math.isnan(never.power(1.0))


@pytest.mark.parametrize(("sizes", "found"), [([], []), ([1.0], [])])
def test_trials_without_answers_are_refused(sizes, found):
    with pytest.raises(ValueError, match="trials: expected"):
        fit_curve(sizes, found)
