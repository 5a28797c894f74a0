"""A mismatch planted at a known time, in a known band, in a known operating region is found there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.thresholds import Places
from estimator.diagnosis.where.locate import band_hz, intervals, region
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import SPEED, TWIST, TWO_MASS, exact_states, linear_record, model

SIGMA = 0.02
TIME_S = np.arange(2000) * 0.01
SWELL = 120.0 * np.sin(2 * np.pi * TIME_S / 10.0)
START = InitialCondition(0.0, 0.0, -6.0, 0.0, -6.0)


def drive(error: FloatArray, name: str = "run_1", seed: int = 1) -> Record:
    """A slow swell through both signs of torque and speed, noise, and an error of the reading."""
    rec = linear_record(TWO_MASS, SWELL, START, sigma=SIGMA, seed=seed, name=name)
    return replace(rec, output=rec.output + error)


def fitted(*records: Record) -> FitResult:
    return fit(make_problem(model(TWO_MASS), records, ()))


def burst(low_s: float, high_s: float, hz: float = 8.0, size: float = 0.3) -> FloatArray:
    inside = (TIME_S >= low_s) & (TIME_S <= high_s)
    return np.where(inside, size * np.sin(2 * np.pi * hz * TIME_S), 0.0)


class TestTime:
    def test_a_burst_is_found_when_it_was(self) -> None:
        found = intervals(fitted(drive(burst(5.0, 8.0)), drive(np.zeros(2000), "run_2", 2)), SIGMA)
        assert list(found) == ["run_1"]
        ((low, high),) = found["run_1"]
        assert low == pytest.approx(5.0, abs=Places.WINDOW_S)
        assert high == pytest.approx(8.0, abs=Places.WINDOW_S)

    def test_noise_is_no_mismatch(self) -> None:
        assert intervals(fitted(drive(np.zeros(2000))), SIGMA) == {}

    @pytest.mark.parametrize("seed", range(5))
    def test_noise_at_the_floor_is_rarely_a_mismatch(self, seed: int) -> None:
        assert intervals(fitted(*(drive(np.zeros(2000), f"run_{i}", 10 * seed + i) for i in range(3))), SIGMA) == {}


def band_of(*records: Record, noise: float = SIGMA) -> tuple[float, float] | None:
    return band_hz(fitted(*records), noise)


class TestBand:
    @pytest.mark.parametrize("hz", [3.0, 8.0, 20.0])
    def test_the_band_holds_the_frequency_and_little_else(self, hz: float) -> None:
        band = band_of(drive(burst(0.0, 20.0, hz)))
        assert band is not None
        assert band[0] <= hz <= band[1]
        assert band[1] - band[0] < 1.0

    def test_recordings_of_different_length_are_added_at_their_frequencies(self) -> None:
        long = drive(burst(0.0, 20.0, 8.0))
        short = replace(
            long,
            name="short",
            time_s=TIME_S[:300],
            torque_nm=long.torque_nm[:300],
            output=long.output[:300],
            okay=long.okay[:300],
        )
        for records in ((long, short), (short, long)):
            band = band_of(*records)
            assert band == pytest.approx((8.0, 8.0), abs=0.7)

    @pytest.mark.parametrize("seed", range(5))
    def test_noise_does_not_widen_the_band(self, seed: int) -> None:
        """A slow mismatch of the noise's own size: nothing but it stands out at any of 257 frequencies."""
        band = band_of(drive(SIGMA * np.sqrt(2.0) * np.sin(2 * np.pi * 0.5 * TIME_S), seed=seed))
        assert band == pytest.approx((0.5, 0.5), abs=0.4)


class TestRegion:
    def errors_where(self, signal: FloatArray, low: float, high: float) -> Record:
        inside = (signal >= low) & (signal <= high)
        return drive(np.where(inside, 0.3 * np.sin(2 * np.pi * 8.0 * TIME_S), 0.0))

    @pytest.mark.parametrize(
        ("element", "name", "share"),
        [
            (Element.SHAFT, "shaft torque", (0.5, 1.0)),
            (Element.TORQUE_PATH, "torque", (-1.0, -0.5)),
            (Element.MOTOR, "motor speed", (-1.0, -0.4)),
            (Element.LOAD, "load speed", (0.3, 1.0)),
            (Element.SPEED_SENSOR, "motor speed", (0.3, 1.0)),
            (Element.ACQUISITION, "motor speed", (0.3, 1.0)),
        ],
    )
    def test_it_is_the_range_of_the_elements_own_signal(
        self, element: Element, name: str, share: tuple[float, float]
    ) -> None:
        states = exact_states(TWO_MASS, SWELL, START)
        signal = {"shaft torque": TWO_MASS["k"] * states[:, TWIST], "torque": SWELL}.get(name, states[:, SPEED])
        top = float(np.max(np.abs(signal)))
        rec = self.errors_where(signal, share[0] * top, share[1] * top)
        found = region(fitted(rec), element)
        assert found.signal == name
        assert share[0] * top - 0.15 * top <= found.low < found.high <= share[1] * top + 0.15 * top

    def test_the_noise_of_the_rest_does_not_widen_it(self) -> None:
        """A faint error in a small part, noise in all: without the floor taken off, the noise decides."""
        states = exact_states(TWO_MASS, SWELL, START)
        top = float(np.max(states[:, SPEED]))
        inside = states[:, SPEED] > 0.8 * top
        rec = drive(np.where(inside, 0.06 * np.sin(2 * np.pi * 8.0 * TIME_S), 0.0))
        found = region(fitted(rec), Element.MOTOR, SIGMA)
        assert found.low > 0.6 * top
        assert region(fitted(rec), Element.MOTOR).low < 0.0
