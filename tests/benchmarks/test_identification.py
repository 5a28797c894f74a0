"""The identification benchmarks judge what they say; small forms of the campaigns."""

from __future__ import annotations

import math

import numpy as np
import pytest

from estimator.identification.linear_model import LinearModel
from tests.benchmarks import identification, peers
from tests.benchmarks.identification import Experiment, Rate, buses, coverage, cruises, experiment
from tests.benchmarks.peers import Score, model_of, read, rows


def test_experiments_keep_the_limits_on_both_simulators() -> None:
    for source in (cruises, buses):
        for truth in source(1):
            assert experiment(truth).is_good


def test_an_experiment_off_its_limit_is_not_good() -> None:
    good = Experiment("run", (0.01, -0.1), (0.0, 0.0), 0.5)
    assert good.is_good
    for online, response_db in (((0.03, 0.0), 0.5), ((0.0, -0.16), 0.5), ((0.0, 0.0), 1.1), ((0.0, 0.0), math.nan)):
        assert not Experiment("run", online, (0.0, 0.0), response_db).is_good


def test_coverage_counts_what_the_intervals_hold() -> None:
    rates = coverage(cruises(4))
    assert set(rates) == {"resonance", "damping", "J_M", "J_L", "k", "c + b_M"}
    assert all(rate.runs == 4 and error < 5 * said for rate, error, said in rates.values())


def test_wilsons_interval() -> None:
    """The formula by hand: centre and reach of (p + z^2 / 2n +- z sqrt(p q / n + z^2 / 4n^2)) / (1 + z^2 / n)."""
    n, p, z = 200, 0.95, 1.959964
    low, high = Rate(190, n).interval
    centre, reach = p + z**2 / (2 * n), z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert (low, high) == pytest.approx(((centre - reach) / (1 + z**2 / n), (centre + reach) / (1 + z**2 / n)))
    assert Rate(190, n).text.startswith("95.0 % (91.0 to 97.3)")


def test_a_peers_polynomials_are_read_as_the_model_they_are() -> None:
    model = LinearModel((-1.6, 0.8), (0.1, 0.05), 1, 0.01)
    read_back = model_of(np.array([0.2, 0.1]), np.array([2.0, -3.2, 1.6]), 0.01)  # scaled, no leading zero
    frequency_hz = np.array([0.5, 8.0, 30.0])
    np.testing.assert_allclose(read_back.response(frequency_hz), model.response(frequency_hz))


def test_what_a_peer_gives_back_is_judged_alike() -> None:
    pair = next(peers.pairs(1))
    right = peers.ours(pair)["Box-Jenkins"]
    fit = peers.fit_box_jenkins(pair.fitted, peers.TWO_MASS).model
    results = {
        "linear|num": fit.B,
        "linear|den": fit.A,
        "own free run|fresh": pair.fresh.output,
        "unstable|num": np.array([0.0, 1.0]),
        "unstable|den": np.array([1.0, -1.1]),
        "none|failed": np.array("ValueError: why"),
    }
    scores = read(results, pair)
    assert scores["linear"] == right
    assert scores["own free run"].fit_percent == pytest.approx(100.0)
    assert scores["unstable"].fit_percent == scores["none"].fit_percent == -math.inf


def test_the_best_median_is_told_first_and_failures_as_none() -> None:
    table = rows(
        {"poor": [Score(20.0), Score(30.0)], "good": [Score(90.0, 0.01, -0.02)] * 2, "lost": [Score(-math.inf)]}
    )
    assert [line[0] for line in table] == ["good", "poor", "lost"]
    assert table[0][1:] == ("90.00 %", "90.00 %", "1.000 %", "2.000 %")
    assert table[2][1:] == ("none", "none", "none", "none")


def test_unknown_part_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        identification.main(["speed"])
    assert "expected accuracy, coverage, truth, came speed" in capsys.readouterr().err
