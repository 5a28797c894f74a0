"""A drive that samples by a clock of its own: ages grow, and begin anew after a whole period."""

from __future__ import annotations

import pytest

from hil.simulator.drive_physics import SampleClock


def test_without_drift_every_sample_is_that_of_its_sync() -> None:
    clock = SampleClock(0.0)
    assert [clock.sample(float(k), 10.0 * k) for k in range(5)] == [(float(k), 10.0 * k) for k in range(5)]


@pytest.mark.parametrize("drift", [0.125, -0.125])
def test_the_age_grows_by_the_drift_and_wraps_after_a_period(drift: float) -> None:
    """Of a speed that grows by 1 per SYNC, what is read is behind by its age."""
    clock = SampleClock(drift * 1e6)
    ages = [k - clock.sample(float(k), 0.0)[0] for k in range(17)]
    assert ages == pytest.approx([0.0] + [(k * drift) % 1.0 for k in range(1, 17)])


def test_a_torque_that_is_not_fresh_is_that_of_the_sync_before() -> None:
    clock = SampleClock(1e5)
    assert [clock.sample(0.0, torque)[1] for torque in (1.0, 2.0, 3.0)] == [1.0, 1.0, 2.0]
