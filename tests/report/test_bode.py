"""Bode plots: the band of a fitted model is that of its parameters, and no phase crosses the figure."""

import numpy as np
import pytest

from estimator.identification.identify import identify
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import square_root
from hil.report import bode
from tests.estimator.identification.driveline import cruise


def test_the_band_of_a_model_is_what_its_parameters_make_of_it() -> None:
    fit = identify(cruise(1).record).batch
    f = np.array([4.0, 8.0, 16.0])
    normal = np.random.default_rng(1).normal(size=(4000, fit.model.theta.size))
    drawn = fit.model.theta + normal @ square_root(fit.covariance).T
    models = [LinearModel.from_theta(theta, fit.model.orders, fit.model.sample_time_s) for theta in drawn]
    ratios = np.array([model.response(f) for model in models]) / fit.model.response(f)
    apart = np.maximum(np.log(np.abs(ratios)).std(axis=0), np.angle(ratios).std(axis=0))
    np.testing.assert_allclose(bode.spread_of(fit, f), 1.96 * apart, rtol=0.1)


@pytest.mark.parametrize("first", [-200.0, 100.0, 170.0])
def test_the_band_of_a_phase_does_not_cross_the_figure(first: float) -> None:
    f = np.geomspace(1.0, 10.0, 50)
    response = np.exp(1j * np.deg2rad(first - np.linspace(0.0, 150.0, 50)))
    figure = bode.panels()
    bode.estimate(figure, f, response, np.full(50, 0.02), np.ones(50), "#777777", "estimate")
    phases = [trace for trace in figure.data if trace.yaxis == "y2" and trace.mode == "lines"]
    assert phases
    assert all(np.abs(np.diff(np.asarray(trace.y))).max() < 10.0 for trace in phases)
    inside = np.rad2deg(np.angle(response))
    lows, highs = phases[::2], phases[1::2]
    held = [
        any(low.y[i] <= inside[i] <= high.y[i] for low, high in zip(lows, highs, strict=True)) for i in range(f.size)
    ]
    assert all(held)
