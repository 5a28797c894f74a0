"""The score of a reported frequency band: in a case's row, in the summary, on the scoreboard."""

import json
import re

import numpy as np
import pytest

from hil.proof.campaign import band as campaign_band
from hil.proof.campaign.band import score_band
from hil.proof.campaign.kinds import kind
from hil.proof.campaign.report import markdown, summary
from hil.proof.mismatch.band import CENTRAL
from hil.proof.mismatch.rest import true_rest_rad_s
from hil.proof.prove.scoreboard import Board, scoreboard_json, scoreboard_page
from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.experiments import SAMPLES
from hil.proof.truth.specimen import draw_specimen

SEED = 3
GAP = kind("backlash")


def _truth(name, seed=SEED):
    return json.loads(json.dumps(draw_specimen(name, seed).truth()))


def _with_band(band_hz):
    return {"mismatch": {"band_hz": band_hz}}


@pytest.fixture(scope="module")
def rest_of_a_gap():
    return true_rest_rad_s(draw_specimen("backlash", SEED))


@pytest.fixture
def of_a_gap(monkeypatch, rest_of_a_gap):
    """The score of a band from 0 to 50 Hz, which tells the true one too; the bus is driven once for all tests."""
    monkeypatch.setattr(campaign_band, "true_rest_rad_s", lambda specimen: rest_of_a_gap)
    return score_band(GAP, SEED, _truth("backlash"), _with_band([0.0, 50.0]))


def test_a_band_of_everything_has_all_the_power_and_is_not_right(of_a_gap):
    assert of_a_gap["power_share"] == pytest.approx(1.0)
    assert of_a_gap["width_ratio"] == pytest.approx(1.0 / of_a_gap["overlap"])
    assert not of_a_gap["right"]
    assert json.loads(json.dumps(of_a_gap, allow_nan=False)) == of_a_gap


def test_the_band_of_the_truth_is_right_and_a_gap_shakes_the_shaft(of_a_gap):
    """A gap acts when the torque through the shaft changes sign, which excites its resonance of 6 to 10 Hz."""
    low, high = of_a_gap["true_hz"]
    assert low < 10.0
    assert high > 6.0
    score = score_band(GAP, SEED, _truth("backlash"), _with_band(of_a_gap["true_hz"]))
    assert score["right"]
    assert score["power_share"] >= CENTRAL
    assert score["width_ratio"] == 1.0


@pytest.mark.parametrize(
    ("planted", "diagnosis"),
    [
        ("none", _with_band([1.0, 2.0])),
        ("off", _with_band([1.0, 2.0])),
        ("backlash", _with_band(None)),
        ("backlash", None),
    ],
)
def test_without_a_mismatch_or_a_band_there_is_no_score(planted, diagnosis):
    assert score_band(kind(planted), SEED, _truth(kind(planted).effect), diagnosis) is None


def test_a_truth_that_can_no_longer_be_drawn_is_reported_and_not_scored():
    truth = _truth("backlash")
    truth["hidden"]["backlash"]["gap_rad"] *= 1.01
    score = score_band(GAP, SEED, truth, _with_band([1.0, 2.0]))
    assert "no longer draws" in score["fault"]
    assert "right" not in score


def test_the_bus_is_drawn_with_the_nominal_error_of_its_kind(monkeypatch):
    drawn = []

    def drawing(effect, seed, nominal_error):
        drawn.append(nominal_error)
        return draw_specimen(effect, seed, nominal_error)

    monkeypatch.setattr(campaign_band, "draw_specimen", drawing)
    monkeypatch.setattr(campaign_band, "true_rest_rad_s", lambda specimen: [np.linspace(-1.0, 1.0, SAMPLES)])
    score_band(GAP, SEED, _truth("backlash"), _with_band([1.0, 2.0]))
    assert drawn == [NOMINAL_ERROR]


def _row(case, band):
    row = {
        "case": case,
        "kind": "backlash",
        "group": "single",
        "seed": SEED,
        "outcome": "right",
        "success": True,
        "fault": None,
        "verdict": "explained",
        "named": ["backlash"],
        "element_right": True,
        "diagnose_s": 1.0,
        "fresh_over_floor": [1.0],
    }
    return row if band is ... else {**row, "band": band}


def _score(right, power_share):
    band = {"told_hz": [6.0, 9.0], "true_hz": [6.5, 8.5], "power_share": power_share, "width_ratio": 1.5}
    return {**band, "overlap": 2.0 / 3.0, "right": right}


ROWS = [
    _row("case_001", _score(True, 0.9)),
    _row("case_002", _score(False, 0.3)),
    _row("case_003", None),
    _row("case_004", {"told_hz": [1.0, 2.0], "fault": "another simulator"}),
    _row("case_005", ...),  # of a campaign from before bands were scored
]


def test_the_summary_counts_the_bands_that_have_a_score():
    figures = summary(ROWS)
    assert (figures["band"]["right"]["hits"], figures["band"]["right"]["trials"]) == (1, 2)
    assert figures["band"]["power_share_median"] == pytest.approx(0.6)
    assert figures["kinds"]["backlash"]["band"] == figures["band"]
    lines = markdown(ROWS).splitlines()
    heading = next(number for number, line in enumerate(lines) if line.startswith("| planted | cases"))
    cells = dict(zip(_cells(lines[heading]), _cells(lines[heading + 2]), strict=True))
    assert cells["band"] == "50 %"


def _cells(line):
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_scoreboard_has_reported_and_true_band_and_a_tile():
    page = re.sub("<[^>]*>", "", scoreboard_page(Board(ROWS)))
    assert "✓ 6.0–9.0 (6.5–8.5)" in page
    assert "✗ 6.0–9.0 (6.5–8.5)" in page
    assert "1.0–2.0 (?)" in page
    assert "right frequency band" in page
    assert scoreboard_json(Board(ROWS))["cases"][0]["band"]["power_share"] == 0.9
