"""Effects that are there but too small to tell, or no case of their kind: each says so with the figure."""

import numpy as np
import pytest

from estimator.physics.catalogue import EFFECTS
from tests.estimator.physics.bench import TWO_MASS, model, record

LINE = model(TWO_MASS)
RECORDS = [record(np.zeros(3001), np.zeros(3001))]  # 30 s at 10 ms


@pytest.mark.parametrize(
    ("name", "key", "reported", "too_small"),
    [
        ("actuator_lag", "time_constant_s", 1.1e-3, 0.9e-3),
        ("speed_filter", "time_constant_s", 1.1e-3, 0.9e-3),
        ("transport_delay", "delay_s", 1.1e-3, 0.9e-3),
        ("clock_drift", "rate", -1.1e-3 / 30.0, -0.9e-3 / 30.0),
    ],
)
def test_a_tenth_of_the_sampling_period_is_the_least_that_is_reported(
    name: str, key: str, reported: float, too_small: float
) -> None:
    unresolved = EFFECTS[name].unresolved
    assert unresolved(LINE, RECORDS, {key: reported}) == ""
    assert "less than a tenth of the sampling period" in unresolved(LINE, RECORDS, {key: too_small})


@pytest.mark.parametrize(
    ("inertia", "frequency_hz", "most"),
    [
        (10.0, 30.0, 0.152),  # so heavy that the shaft next to it takes next to nothing: 9 / (4 pi 10 30) = 0.002
        (0.5, 16.0, 0.2395),  # 9 / (4 pi 0.5 16) = 0.0895 on top of 0.15
        (0.01, 16.0, 0.25),  # what amplifies less than twice is no resonance
    ],
)
def test_a_mode_may_be_damped_by_itself_and_by_the_shaft_next_to_it(
    inertia: float, frequency_hz: float, most: float
) -> None:
    assert LINE.parameters["c"].value == 9.0
    implausible = EFFECTS["extra_torsional_mode"].implausible
    branch = {"inertia_kg_m2": inertia, "frequency_hz": frequency_hz}
    assert implausible(LINE, RECORDS, {**branch, "damping_ratio": most - 0.002}) == ""
    assert "is no mode" in implausible(LINE, RECORDS, {**branch, "damping_ratio": most + 0.002})


def test_an_inertia_on_a_spring_too_stiff_to_follow_is_no_mode() -> None:
    implausible = EFFECTS["extra_torsional_mode"].implausible
    between = {"inertia_kg_m2": 0.0, "frequency_hz": 40.0, "between_kg_m2": 0.3, "damping_ratio": 0.05}
    assert implausible(LINE, RECORDS, {**between, "line_share": 0.94}) == ""
    assert "belongs to the motor" in implausible(LINE, RECORDS, {**between, "line_share": 0.95})
    behind = {**between, "between_kg_m2": 0.0, "behind_kg_m2": 0.3}
    assert "belongs to the load" in implausible(LINE, RECORDS, {**behind, "line_share": 0.95})


def test_a_loss_that_is_complete_at_once_is_not_from_warming() -> None:
    implausible = EFFECTS["torque_derating"].implausible
    assert implausible(LINE, RECORDS, {"depth": 0.2, "time_constant_s": 3.0}) == ""
    assert "not from warming" in implausible(LINE, RECORDS, {"depth": 0.2, "time_constant_s": 0.6})
