"""Single rules of the five tests."""

from __future__ import annotations

from dataclasses import replace

import pytest

from estimator.diagnosis.evidence import gain
from estimator.diagnosis.holdout import HoldOut
from estimator.diagnosis.hypotheses import NOTHING
from estimator.diagnosis.selection import Jury
from estimator.diagnosis.selection.jury import SIGNIFICANT
from estimator.diagnosis.trial import Trial
from tests.estimator.diagnosis.planted import quiet, rubbing
from tests.estimator.diagnosis.regression import of_rms
from tests.estimator.diagnosis.selection.mass import COULOMB, STRIBECK, coulomb, jury
from tests.estimator.physics.bench import ONE_MASS


@pytest.fixture(scope="module")
def judging() -> Jury:
    return jury(quiet(values=ONE_MASS, samples=900), floor=0.1)


class TestRules:
    """Single rules on fits of a given RMS and white errors."""

    def trial(self, name: str, rms: float, unknowns: int = 3) -> Trial:
        result = of_rms(rms, unknowns)
        return Trial(name, frozenset({name}), result, gain(self.RETUNED, result), None, 0.0, None)

    RETUNED = of_rms(1.0, 2)

    def test_chance_is_a_reason_to_fail(self, judging: Jury) -> None:
        """A probability of 0.005 is 0.09 after 18 hypotheses."""
        result = of_rms(1.0, 3)
        strong = replace(gain(self.RETUNED, of_rms(0.9, 3)), delta_bic=20.0, p_value=0.005)
        p_value = strong.p_value * len(judging.names)
        assert p_value > SIGNIFICANT
        failed = judging._statistics_fail(COULOMB, result, strong, p_value)
        assert failed == "could be chance (p = 0.09 after 18 hypotheses)"

    @pytest.mark.parametrize(
        ("held", "holds"),
        [
            (HoldOut(1.0, 0.7), True),  # half of the power, three quarters of it where it was fitted
            (HoldOut(1.0, 0.95), False),  # a tenth
            (HoldOut(1.0, 0.95, spread=0.1), True),  # but unseen samples are too few to tell
            (HoldOut(0.101, 0.101), True),  # there was nothing to gain: the error was the noise already
            (HoldOut(0.101, 0.12), False),  # and it got worse
        ],
    )
    def test_a_gain_has_to_show_where_it_was_not_fitted(
        self, monkeypatch: pytest.MonkeyPatch, held: HoldOut, holds: bool
    ) -> None:
        monkeypatch.setattr(Jury, "_examine", lambda *_: held)
        judging = jury(quiet(values=ONE_MASS, samples=600), floor=0.1)
        before, trial = of_rms(1.0, 2), self.trial(COULOMB, 0.5)
        assert judging.holds_out(trial, before) is holds

    @pytest.mark.parametrize(("lag_rms", "named"), [(0.15, False), (0.3, True)])
    def test_nothing_is_named_in_place_of_what_is_too_small_to_tell(
        self, judging: Jury, monkeypatch: pytest.MonkeyPatch, lag_rms: float, named: bool
    ) -> None:
        """A lag of no time at all that explains more than friction bars it; one that explains less does not."""
        lag = replace(self.trial("actuator_lag", lag_rms), failed="less than a tenth of the sampling period")
        values = {"actuator_lag": {"time_constant_s": 0.0}, COULOMB: {"friction_nm": 1.0}}
        monkeypatch.setattr(Trial, "values", property(lambda trial: values[trial.name]))
        monkeypatch.setattr(Jury, "holds_out", lambda *_: True)
        monkeypatch.setattr(Jury, "examined", lambda _, trial, __: trial)
        trials = {"actuator_lag": lag, COULOMB: self.trial(COULOMB, 0.2)}
        best = judging.best(trials, self.RETUNED, self.RETUNED)
        assert (best is not None) is named

    @pytest.mark.parametrize(("lighter_rms", "named"), [(0.15, False), (0.1, True)])
    def test_what_was_too_light_to_count_is_no_evidence_for_another(
        self, judging: Jury, monkeypatch: pytest.MonkeyPatch, lighter_rms: float, named: bool
    ) -> None:
        """A small rest that a second law of the shaft explains best is not told as friction that explains less."""
        monkeypatch.setattr(Jury, "_beyond_rest", lambda *_: True)
        monkeypatch.setattr(Jury, "holds_out", lambda *_: True)
        monkeypatch.setattr(Jury, "examined", lambda _, trial, __: trial)
        before = of_rms(0.2, 3)
        trials = {
            name: replace(self.trial(name, rms, 4), effects=frozenset({"backlash", name}))
            for name, rms in (("stiffness_nonlinearity", 0.1), (COULOMB, lighter_rms))
        }
        best = judging.best(trials, before, self.RETUNED)
        assert (None if best is None else best.name) == (COULOMB if named else None)

    def test_the_special_case_is_taken_where_the_general_one_adds_little(self, judging: Jury) -> None:
        special = self.trial(COULOMB, 0.2)
        for general_rms, taken in ((0.199, special.name), (0.1, STRIBECK)):
            general = self.trial(STRIBECK, general_rms, 5)
            assert judging._simpler(general, {COULOMB: special, STRIBECK: general}, self.RETUNED).name == taken

    def test_a_special_case_that_failed_is_no_alternative(self, judging: Jury) -> None:
        special = replace(self.trial(COULOMB, 0.2), failed="could be chance")
        general = self.trial(STRIBECK, 0.199, 5)
        assert judging._simpler(general, {COULOMB: special, STRIBECK: general}, self.RETUNED) is general

    def test_a_null_inside_is_a_reason_to_fail(self) -> None:
        records = rubbing(lambda speed: 0.0)
        judging = jury(records)
        result = judging.bench.fit(frozenset({COULOMB}), judging.bench.fit(NOTHING))
        strong = replace(gain(of_rms(1.0, 2), of_rms(0.5, 3)), delta_bic=50.0, p_value=1e-9)
        failed = judging._statistics_fail(COULOMB, result, strong, 1e-8)
        assert failed == "its interval includes the value at which it does nothing"

    def test_an_effect_whose_fit_got_better_is_judged_anew(self) -> None:
        """A fit from more starts is not told with the evidence of the poorer one."""
        judging = jury(rubbing(coulomb))
        alone = frozenset({COULOMB})
        retuned = judging.bench.fit(NOTHING)
        right = judging.bench.fit(alone, retuned)
        poorer = judging.trial(COULOMB, alone, retuned, replace(right, residual=1.5 * right.residual))
        assert judging.final(COULOMB, alone, right, poorer).gain == gain(retuned, right)
        same = judging.trial(COULOMB, alone, retuned, right)
        assert judging.final(COULOMB, alone, right, same) is same
