"""How much of a mismatch an explanation may leave, and to what it must not leave it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.evidence import gain
from estimator.diagnosis.hypotheses import Effects
from estimator.diagnosis.judgement import MOST_VISIBLE, NEAR_FLOOR, NEAR_FLOOR_PROFILE, judge
from estimator.diagnosis.unnamed import UnnamedLaw
from estimator.diagnosis.weight import MOST
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.signals.record import OutputKind
from tests.estimator.diagnosis.outcome import outcome
from tests.estimator.diagnosis.regression import autoregressive, of_rms

COULOMB: Effects = frozenset({"coulomb_friction_motor"})
ROAD: Effects = frozenset({"road_grade"})
CUBIC: Effects = frozenset({"stiffness_nonlinearity"})


class TestHowMuchMayBeLeft:
    """On white errors of a given RMS, floor 0.1: what stands above it, and what is left of that."""

    FLOOR = 0.1

    def objection(self, before: float, after: float, chosen: Effects = COULOMB) -> str:
        return judge(outcome(of_rms(before, 2), chosen, of_rms(after, 3)), self.FLOOR).objection

    def test_the_limits_are_these(self) -> None:
        assert (MOST, MOST_VISIBLE, NEAR_FLOOR, NEAR_FLOOR_PROFILE) == (0.8, 0.9, 1.5, 1.15)

    @pytest.mark.parametrize(
        ("before", "after", "left"),
        [
            (1.0, 0.145, ""),  # 1.45 times the noise, and (0.145^2 - 0.1^2) / (1 - 0.1^2) = 1 % of the mismatch
            (1.0, 0.157, "1% of the mismatch, 1.6 times the noise"),
            (0.2, 0.112, ""),  # (0.112^2 - 0.1^2) / (0.2^2 - 0.1^2) = 8 %
            (0.2, 0.12, "15% of the mismatch, 1.2 times the noise"),  # seen, and more than a tenth
            (0.16, 0.113, ""),  # 18 %, hardly seen
            (0.2, 0.13, "23% of the mismatch, 1.3 times the noise"),
            (1.0, 0.5, "24% of the mismatch, 5 times the noise"),
            (9.0, 0.24, ""),  # 0.06 % of the mismatch: a detail of how the law is written
            (9.0, 0.26, "0% of the mismatch, 2.6 times the noise"),
        ],
    )
    def test_a_fifth_of_the_mismatch_and_half_again_the_noise(self, before: float, after: float, left: str) -> None:
        objection = self.objection(before, after)
        assert objection == (f"dry friction at the motor would leave {left}" if left else "")

    @pytest.mark.parametrize(
        ("before", "after", "believed"),
        [
            (0.5, 0.114, True),
            (0.5, 0.116, False),  # 1.16 times the noise, and (0.116^2 - 0.1^2) / (0.5^2 - 0.1^2) = 1.4 %
            (1.0, 0.12, True),  # 0.44 % of the mismatch: a detail
            (1.0, 0.124, False),  # 0.54 %
            (9.0, 0.151, False),  # 0.02 %, but half again the noise
        ],
    )
    def test_a_profile_alone_must_come_nearer_or_leave_a_detail(
        self, before: float, after: float, believed: bool
    ) -> None:
        assert (self.objection(before, after, ROAD) == "") is believed
        assert (self.objection(before, after, ROAD | COULOMB) == "") is (after < 0.15)

    @pytest.mark.parametrize(
        ("after", "believed"),
        [
            (0.24, True),  # 2.4 times the noise, and (0.24^2 - 0.1^2) / (1 - 0.1^2) = 4.8 % of the mismatch
            (0.25, False),  # 5.3 %
        ],
    )
    def test_a_wave_may_leave_its_harmonics(self, after: float, believed: bool) -> None:
        ripple: Effects = frozenset({"torque_ripple"})
        assert (self.objection(1.0, after, ripple) == "") is believed
        assert self.objection(1.0, after, ripple | COULOMB) != ""

    @pytest.mark.parametrize(
        ("chosen", "after", "believed"),
        [
            (frozenset({"brake_drag"}) | COULOMB, 0.114, True),
            (frozenset({"brake_drag"}) | COULOMB, 0.117, False),  # seen above the noise
            (ROAD | COULOMB, 0.117, False),
            (ROAD | COULOMB, 0.114, True),
            (ROAD | {"brake_drag"}, 0.114, False),  # two that bend at one place
            (CUBIC | COULOMB, 0.117, True),  # laws do not bend
        ],
    )
    def test_what_bends_beside_others_may_leave_no_law_that_is_seen(
        self, chosen: Effects, after: float, believed: bool
    ) -> None:
        before = of_rms(0.5, 2)
        rest = UnnamedLaw(Element.LOAD, (("sign(w_L)", 1.0),), gain(of_rms(0.5, 2), of_rms(0.4, 3)), 0.1)
        objection = judge(outcome(before, chosen, of_rms(after, 3), remaining=rest), 0.1).objection
        assert objection.endswith("a law of sign(w_L) at the load side unexplained") is not believed
        assert (objection == "") is believed
        assert judge(outcome(before, chosen, of_rms(after, 3)), 0.1).objection == ""

    @pytest.mark.parametrize(
        ("chosen", "after", "believed"),
        [
            (frozenset({"extra_torsional_mode", "actuator_lag"}), 0.114, True),
            (
                frozenset({"extra_torsional_mode", "actuator_lag"}),
                0.117,
                False,
            ),  # seen: a detail of 0.005 % all the same
            (frozenset({"extra_torsional_mode"}), 0.117, False),  # a shaft that relaxes
            (frozenset({"extra_torsional_mode"}), 0.114, True),
            (frozenset({"actuator_lag"}), 0.117, True),  # of another order
            (frozenset({"extra_torsional_mode"}) | COULOMB, 0.117, True),  # another way to write the friction
        ],
    )
    def test_several_linear_systems_and_one_of_the_line_may_leave_no_law_that_is_seen(
        self, chosen: Effects, after: float, believed: bool
    ) -> None:
        before = of_rms(9.0, 2)
        rest = UnnamedLaw(Element.SHAFT, (("e", 1.0),), gain(before, of_rms(0.1, 3)), 0.1)
        objection = judge(outcome(before, chosen, of_rms(after, 3), remaining=rest), 0.1).objection
        assert objection.endswith("at the shaft unexplained") is not believed
        assert (objection == "") is believed

    @pytest.mark.parametrize(("fewer", "believed"), [(0, True), (3, False)])
    def test_a_rival_is_simpler_with_the_same_number_of_samples_only(self, fewer: int, believed: bool) -> None:
        """A road and a law leave as much with as many unknowns: none is simpler, however correlated one error is."""
        before, road = of_rms(1.0, 2), of_rms(0.1, 6)
        named = gain(before, road)
        price = (4 - fewer) * math.log(named.n_effective)
        worth = named.n_effective * 2.0 * math.log(1.0 / 0.0999)
        rival = UnnamedLaw(Element.LOAD, (("sign(w_L)", 1.0),), replace(named, delta_bic=worth - price), 0.0999)
        errors = autoregressive(0.3, road.residual.size, np.random.default_rng(5))
        correlated = replace(road, residual=0.1 / np.sqrt(np.mean(errors**2)) * errors)
        assert named.delta_bic - gain(before, correlated).delta_bic > 100.0
        found = outcome(before, ROAD, correlated)
        assert (judge(replace(found, unnamed=rival), 0.1).objection == "") is believed

    @pytest.mark.parametrize(
        ("element", "term", "believed"),
        [
            (Element.LOAD, "sign(w_L)", False),
            (Element.LOAD, "a slow course of the load in {}", True),  # the profile itself, in a few words
            (Element.MOTOR, "dw_M/dt from 2.0 s on in {}", False),
        ],
    )
    def test_a_profile_in_other_words_is_no_rival_of_a_profile(
        self, element: Element, term: str, believed: bool
    ) -> None:
        before, road = of_rms(1.0, 2), of_rms(0.1, 6)
        named = gain(before, road)
        cheap = named.n_effective * 2.0 * math.log(1.0 / 0.0999) - math.log(named.n_effective)
        name = road.problem.records[0].name
        law = UnnamedLaw(element, ((term.format(name), 1.0), ("w_L", 0.1)), replace(named, delta_bic=cheap), 0.0999)
        assert (judge(replace(outcome(before, ROAD, road), unnamed=law), 0.1).objection == "") is believed

    @pytest.mark.parametrize(("share", "left"), [(0.6, ""), (0.8, "64% of the mismatch")])
    def test_of_a_position_half(self, share: float, left: str) -> None:
        """0.6^2 = 36 % and 0.8^2 = 64 % are left; how near to the noise is not asked."""

        def as_position(result: FitResult) -> FitResult:
            records = tuple(replace(rec, kind=OutputKind.POSITION) for rec in result.problem.records)
            return replace(result, problem=replace(result.problem, records=records))

        before, after = as_position(of_rms(1.0, 2)), as_position(of_rms(share, 3))
        objection = judge(outcome(before, COULOMB, after), 1e-6).objection
        assert objection == (f"dry friction at the motor would leave {left}" if left else "")
