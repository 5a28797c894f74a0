"""One trial: ranks of rivals with one number of independent samples for all, and nulls."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.evidence import gain, information
from estimator.diagnosis.hypotheses import NOTHING, everything
from estimator.diagnosis.intervals import covariance, interval
from estimator.diagnosis.trial import Trial, null_inside, pressed_parameters, ranks
from estimator.physics.fit import FitResult
from estimator.physics.start import Start
from tests.estimator.diagnosis.planted import Friction, rubbing
from tests.estimator.diagnosis.regression import of_rms
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps

ONE, COULOMB = model(ONE_MASS), "coulomb_friction_motor"
LAG, FILTER, DELAY = "actuator_lag", "speed_filter", "transport_delay"
RETUNED = of_rms(1.0, 2)


def trial(name: str, gained: float) -> Trial:
    """A trial with one more unknown than the re-tuned nominal that gains this much information."""
    n = gain(RETUNED, of_rms(0.9, 3)).n_effective
    result = of_rms(float(np.exp(-(gained + np.log(n)) / (2.0 * n))), 3)
    assert information(RETUNED, result, n) == pytest.approx(gained, abs=1e-6)
    return Trial(name, frozenset({name}), result, gain(RETUNED, result), None, 0.0, None)


def ranked(gains: dict[str, float]) -> list[str]:
    found = ranks([trial(name, gained) for name, gained in gains.items()], RETUNED)
    return sorted(found, key=lambda name: -found[name])


@pytest.mark.parametrize("ahead", [0.0, 9.0])
def test_of_twins_that_tie_the_first_along_the_chain_counts_more(ahead: float) -> None:
    assert ranked({FILTER: 100.0 + ahead, LAG: 100.0}) == [LAG, FILTER]


def test_a_gap_decides_between_twins() -> None:
    assert ranked({FILTER: 111.0, LAG: 100.0}) == [FILTER, LAG]


@pytest.mark.parametrize(("gained", "place"), [(120.0, 0), (103.0, 2), (90.0, 2)])
def test_others_keep_their_place(gained: float, place: int) -> None:
    """Both twins count for the better one's 105; what is no twin of theirs for what it gains itself."""
    assert ranked({FILTER: 105.0, DELAY: gained, LAG: 100.0}).index(DELAY) == place


def test_how_correlated_an_error_is_does_not_decide() -> None:
    """Of two rivals the one that leaves less ranks first, though its own n is smaller and its own BIC gains less."""
    better, worse = of_rms(0.5, 3), of_rms(0.6, 3)
    few = Trial(LAG, frozenset({LAG}), better, gain(RETUNED, better), None, 0.0, None)
    short = type(few.gain)(few.gain.delta_bic / 10.0, few.gain.p_value, few.gain.n_effective / 10.0)
    trials = [
        Trial(LAG, frozenset({LAG}), better, short, None, 0.0, None),
        Trial(DELAY, frozenset({DELAY}), worse, gain(RETUNED, worse), None, 0.0, None),
    ]
    assert trials[1].gain.delta_bic > trials[0].gain.delta_bic
    found = ranks(trials, RETUNED)
    assert found[LAG] > found[DELAY]


@pytest.mark.parametrize(("factor", "pressed"), [(1.1, frozenset()), (1.5, frozenset({"k"}))])
def test_a_parameter_that_should_go_further_than_it_is_trusted_to_is_pressed(
    factor: float, pressed: frozenset[str]
) -> None:
    """A shaft 10 % softer than the nominal one is re-tuned, one a third softer ends at the bound of 20 %."""
    record = linear_record(TWO_MASS, random_steps(1500, 3), Start(5.0, 0.0, 2.0), sigma=0.02)
    nominal = model(TWO_MASS | {"k": factor * TWO_MASS["k"]})
    assert pressed_parameters(Bench(nominal, [record], everything([record])).fit(NOTHING)) & {"k"} == pressed


class TestNull:
    def fitted(self, friction: Friction) -> FitResult:
        records = rubbing(friction)
        bench = Bench(ONE, records, everything(records))
        return bench.fit(frozenset({COULOMB}), bench.fit(NOTHING))

    def test_an_interval_that_excludes_the_null_tells(self) -> None:
        assert not null_inside(COULOMB, self.fitted(lambda speed: 12.0))

    def test_an_effect_that_is_not_there_includes_it(self) -> None:
        result = self.fitted(lambda speed: 0.0)
        index = [(s.effect, s.name) for s in result.problem.shared].index((COULOMB, "friction_nm"))
        low, high = interval(result, covariance(result), index)
        assert null_inside(COULOMB, result)
        assert low <= 0.0 <= high

    def test_a_profile_has_no_single_null(self) -> None:
        assert not null_inside("road_grade", self.fitted(lambda speed: 12.0))
