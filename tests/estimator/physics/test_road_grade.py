"""The basis of a road's profile: what it can follow, and what it leaves to other laws."""

import numpy as np

from estimator.physics.effects.load import KNOT_SPACING_S, grade_basis


class TestRoadGradeBasis:
    TIME_S = np.arange(2001) * 0.01

    def test_with_the_first_spline_they_would_sum_to_one(self) -> None:
        """A cubic B-spline over [0, d] that starts the partition of unity is (1 - t/d)^3."""
        first = np.maximum(1.0 - self.TIME_S / KNOT_SPACING_S, 0.0) ** 3
        np.testing.assert_allclose(grade_basis(self.TIME_S).sum(axis=0) + first, 1.0, atol=1e-12)

    def test_with_a_constant_it_reproduces_every_cubic(self) -> None:
        t = self.TIME_S / 20.0
        design = np.vstack([np.ones_like(t), grade_basis(self.TIME_S)]).T
        cubic = 3.0 - 2.0 * t + 5.0 * t**2 - 4.0 * t**3
        left = cubic - design @ np.linalg.lstsq(design, cubic, rcond=None)[0]
        np.testing.assert_allclose(left, 0.0, atol=1e-10)

    def test_a_smooth_road_is_followed_and_a_step_is_not(self) -> None:
        design = np.vstack([np.ones_like(self.TIME_S), grade_basis(self.TIME_S)]).T
        hill = np.sin(2 * np.pi * self.TIME_S / 15.0)
        step = np.where(self.TIME_S > 9.0, 1.0, -1.0)
        left = [profile - design @ np.linalg.lstsq(design, profile, rcond=None)[0] for profile in (hill, step)]
        assert np.sqrt(np.mean(left[0] ** 2)) < 5e-3
        assert np.sqrt(np.mean(left[1] ** 2)) > 0.1
