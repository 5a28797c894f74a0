"""The whole chain on eight simulated drives: what DESIGN and the paper ask of it."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.errors import BadSetting, NotExciting
from estimator.identification.identify import Identification, identify, observation_filter
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.online.recursive import Status
from estimator.identification.settings import FilterPart, Settings
from tests.estimator.identification.driveline import Cruise, cruise


def test_every_drive_gives_resonance_within_2_and_damping_within_15_percent(
    cruises: list[Cruise], identified: list[Identification]
) -> None:
    for drive, result in zip(cruises, identified, strict=True):
        for mode in (result.online_resonance, result.batch_resonance):
            assert mode is not None
            assert mode.frequency_hz == pytest.approx(drive.resonance_hz, rel=0.02)
            assert mode.damping == pytest.approx(drive.damping, rel=0.15)
        assert result.estimate.status is Status.ESTIMATED


def test_online_and_spectral_estimate_agree_around_the_resonance(identified: list[Identification]) -> None:
    for result in identified:
        spectral = result.spectral
        assert spectral is not None
        band = (spectral.frequency_hz > 6) & (spectral.frequency_hz < 11) & (spectral.coherence > 0.9)
        model = np.abs(result.online.response(spectral.frequency_hz[band]))
        ratio_db = 20 * np.log10(model / np.abs(spectral.response[band]))
        assert np.count_nonzero(band) > 15
        assert np.abs(ratio_db).max() < 2.0
        assert np.abs(np.mean(ratio_db)) < 0.5


def test_lost_stretches_do_not_move_the_resonance() -> None:
    drive = cruise(20, duration_s=40.0)
    okay = np.ones(drive.record.okay.shape, dtype=bool)
    for start in range(150, 3900, 250):
        okay[start : start + 40] = False  # 0.4 s in every 2.5 s
    output = np.where(okay, drive.record.output, np.nan)
    result = identify(replace(drive.record, output=output, okay=okay), Settings(samples=None))
    for mode in (result.online_resonance, result.batch_resonance):
        assert mode is not None
        assert mode.frequency_hz == pytest.approx(drive.resonance_hz, rel=0.02)
        assert mode.damping == pytest.approx(drive.damping, rel=0.15)
    assert result.spectral is not None  # of shorter segments than asked for, between the gaps
    assert result.spectral.used_samples <= np.count_nonzero(okay)


def test_the_filter_keeps_what_oscillates_and_leaves_slow_and_real_poles_out() -> None:
    fast = 0.94 * np.exp(1j * 1.03)
    slow = 0.999 * np.exp(1j * 0.002)
    poles = [fast, fast.conjugate(), slow, slow.conjugate(), -0.5]
    model = LinearModel(tuple(np.real(np.poly(poles))[1:].tolist()), (1.0,), 1, 0.02)
    np.testing.assert_allclose(
        observation_filter(model, FilterPart.OSCILLATING, 2.0), np.real(np.poly(poles[:2])), rtol=1e-6
    )
    dull = LinearModel((-0.5,), (1.0,), 1, 0.02)
    assert observation_filter(dull, FilterPart.OSCILLATING, 2.0).tolist() == [1.0]


def test_without_excitation_the_refusal_names_the_parameters() -> None:
    with pytest.raises(NotExciting, match="cruise") as refusal:
        identify(cruise(0, prbs_nm=0.0).record)
    assert refusal.value.names == Orders().names


@pytest.mark.parametrize("sample_time_s", [0.015, 0.1])
def test_a_period_that_does_not_divide_is_refused(cruises: list[Cruise], sample_time_s: float) -> None:
    record = replace(cruises[0].record, sample_time_s=sample_time_s)
    with pytest.raises(BadSetting, match=f"sampled every {sample_time_s} s, expected a whole fraction"):
        identify(record)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"sample_time_s": 0.0}, "sample_time_s is 0.0"),
        ({"samples": -1}, "samples is -1"),
        ({"samples": 0}, "samples is 0"),
        ({"band_hz": (9.0, 3.0)}, "band_hz is 9.0"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict[str, float], named: str) -> None:
    with pytest.raises(BadSetting, match=named):
        Settings(**settings)  # type: ignore[arg-type]
