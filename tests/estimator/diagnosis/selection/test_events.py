"""Events of a selection: their moments were sought."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.evidence import gain
from estimator.diagnosis.selection import Selection
from estimator.diagnosis.trial import has_edge, healed_in, scan_choices
from estimator.physics.catalogue import EFFECTS
from estimator.physics.own_scan import MOST_CELLS
from tests.estimator.diagnosis.selection.mass import BRAKE_NM, COULOMB, braked_records, selector

WHOLE_S = (0.0, 11.99)


class TestEvents:
    """Intervals are chosen among many: each that was placed is paid for."""

    @pytest.fixture(scope="class")
    @staticmethod
    def braked() -> Selection:
        return selector(braked_records(), ["brake_drag", COULOMB, "actuator_lag"]).run()

    def test_an_event_is_chosen(self, braked: Selection) -> None:
        assert braked.chosen == {"brake_drag"}
        assert braked.result.value("brake_drag", "brake_nm") == pytest.approx(BRAKE_NM, rel=0.03)

    def test_intervals_of_every_recording_that_has_one_were_chosen(self, braked: Selection) -> None:
        """Of 40 cells half of 40^2 intervals can be made."""
        assert MOST_CELLS == 40
        assert scan_choices("brake_drag", braked.result) == pytest.approx(2.0 * np.log(800.0))
        assert scan_choices(COULOMB, braked.result) == 0.0

    def test_it_begins_and_ends_inside_a_recording(self, braked: Selection) -> None:
        assert has_edge("brake_drag", braked.result)

    @pytest.mark.parametrize(("seen_s", "edged"), [((4.0, 7.0), True), ((4.0, 4.5), False), (WHOLE_S, False)])
    def test_a_glimpse_beside_whole_recordings_is_no_beginning(
        self, braked: Selection, monkeypatch: pytest.MonkeyPatch, seen_s: tuple[float, float], edged: bool
    ) -> None:
        """Dry friction at the load is hidden in recordings that do not reverse: there a brake would act for no time."""
        moments = [seen_s, WHOLE_S, (0.0, 0.0)]
        monkeypatch.setattr("estimator.diagnosis.trial.moments_of", lambda *_: moments)
        assert has_edge("brake_drag", braked.result) is edged

    def test_a_brake_may_be_let_go_a_crack_does_not_heal(
        self, braked: Selection, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        assert healed_in("brake_drag", braked.result) == ""
        as_crack = replace(EFFECTS["brake_drag"], step=EFFECTS["stiffness_change"].step)
        monkeypatch.setattr("estimator.diagnosis.trial.EFFECTS", {"brake_drag": as_crack})
        assert healed_in("brake_drag", braked.result) == "run_1"

    def test_they_are_paid_for(self, braked: Selection) -> None:
        trial = braked.accepted["brake_drag"]
        plain, choices = gain(braked.retuned, trial.result), scan_choices("brake_drag", trial.result)
        assert choices >= scan_choices("brake_drag", braked.result)
        assert trial.gain.delta_bic == pytest.approx(plain.delta_bic - 2.0 * choices)
        assert trial.p_value == pytest.approx(min(1.0, plain.p_value * 3 * np.exp(choices)))
