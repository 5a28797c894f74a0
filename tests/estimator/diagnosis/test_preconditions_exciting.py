"""Recordings that excite nothing are refused; partial excitation and odd models are reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.inertia import model_warnings
from estimator.diagnosis.preconditions.prepare import prepare, require_excitation
from estimator.errors import NotExciting
from estimator.physics.driveline import Start
from estimator.signals.record import Record
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, record, scaled

LINE = model(TWO_MASS)
SIGMA = 0.02
N = 3000


def noise(size: float, seed: int) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal(N)


def drive(torque_nm: np.ndarray, name: str = "run") -> Record:
    return linear_record(TWO_MASS, torque_nm, Start(10.0, 0.0, 20.0, 0.0, 20.0), sigma=SIGMA, name=name)


def test_noise_alone_is_refused() -> None:
    still = record(50.0 + noise(0.3, 1), 40.0 + noise(SIGMA, 2))
    with pytest.raises(
        NotExciting, match=r"the speed moves by .* beyond a noise of 0.0\d*, expected more than the noise"
    ):
        prepare([still], LINE)


def test_zeros_of_lost_readings_are_no_noise() -> None:
    """At 84 rad/s every lost reading is a spike, and 3 % of them are more than all that the torque moves."""
    run = linear_record(TWO_MASS, random_steps(N, 1), Start(84.0, 0.0, 84.0, 0.0, 84.0), sigma=SIGMA)
    lost = np.random.default_rng(3).random(N) < 0.03
    read = replace(run, output=np.where(lost, 0.0, np.round(run.output, 5)))
    with pytest.raises(NotExciting):
        require_excitation([read], LINE)
    assert prepare([read], LINE).warnings == prepare([run], LINE).warnings


def test_a_torque_that_moves_nothing_is_refused() -> None:
    """The line coasts: it moves, but the torque has no part in it."""
    coast = record(noise(0.02, 1), 80.0 * np.exp(-0.05 * 0.01 * np.arange(N)) + noise(SIGMA, 2), name="coast")
    with pytest.raises(NotExciting, match=r"less than its noise of .*: the torque excites nothing") as refusal:
        prepare([coast], LINE)
    assert refusal.value.names == ("coast",)


def test_one_recording_that_excites_is_enough() -> None:
    still = record(50.0 + noise(0.3, 1), 40.0 + noise(SIGMA, 2), name="still")
    assert require_excitation([still, drive(random_steps(N, 1))], LINE) == []


def slow_torque() -> np.ndarray:
    return 100.0 * np.sin(0.4 * 0.01 * np.arange(N))


def test_a_mode_that_is_not_excited_is_reported() -> None:
    (warning,) = prepare([drive(slow_torque())], LINE).warnings
    assert warning.startswith("at and above the model's first mode (8.32 Hz) the torque moves the speed by")
    assert "stiffness, damping and effects of the shaft can't be determined" in warning
    assert warning.endswith("Superpose a PRBS, or a tip-in.")


def test_one_mass_has_no_mode_to_excite() -> None:
    torque = slow_torque()
    rec = linear_record(ONE_MASS, torque, Start(0.0, 0.0, 3.0), sigma=SIGMA)
    assert prepare([rec], model(ONE_MASS)).warnings == ()


def test_a_mode_too_fast_for_the_sampling_is_reported() -> None:
    stiff = model(scaled(TWO_MASS, k=100.0))
    (warning,) = require_excitation([drive(random_steps(N, 1))], stiff)
    assert "first mode is at 83.2 Hz, beyond the 50 Hz that a sampling period of 0.01 s can show" in warning


def test_effects_of_the_model_do_not_hide_what_the_torque_does() -> None:
    stuck = model(TWO_MASS, effects={"coulomb_friction_motor": {"friction_nm": 1e4}})
    assert require_excitation([drive(random_steps(N, 1))], stuck) == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"J_M": 3e4}, "J_L = 40 and J_M = 48000 differ by a factor of 1.2e+03"),
        ({"J_L": 1e3}, "J_M = 1.6 and J_L = 40000 differ by a factor of 2.5e+04"),
        ({"c": 100.0}, "with c = 900 and k = 4200 the first mode (8.32 Hz) is damped 5.6 times critically"),
    ],
)
def test_values_that_are_hardly_meant_are_reported(changes: dict[str, float], said: str) -> None:
    (warning,) = model_warnings(model(scaled(TWO_MASS, **changes)))
    assert said in warning
    assert warning.endswith("?")


@pytest.mark.parametrize("values", [TWO_MASS, ONE_MASS])
def test_usual_values_pass(values: dict[str, float]) -> None:
    assert model_warnings(model(values)) == []


def test_they_are_among_the_warnings_of_a_diagnosis() -> None:
    damped = model(scaled(TWO_MASS, c=100.0))
    ready = prepare([drive(random_steps(N, 1))], damped)
    assert any("times critically" in warning for warning in ready.warnings)
    assert ready.records == ready.segments.records
    assert replace(ready, warnings=()).holdout == ()
