"""Fits that did not converge: told, and nothing is explained by them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.convergence import unconverged
from estimator.diagnosis.hypotheses import NOTHING, Effects, everything
from estimator.diagnosis.judgement import judge
from estimator.diagnosis.result import Fit, Verdict
from estimator.diagnosis.selection import Selection
from estimator.diagnosis.wording import statement
from tests.estimator.diagnosis.outcome import outcome
from tests.estimator.diagnosis.planted import SIGMA, rubbing
from tests.estimator.physics.bench import ONE_MASS, model

COULOMB: Effects = frozenset({"coulomb_friction_motor"})
FIGURES = Fit("rad/s", 1.0, 1.0, 1.0, 1.0, 1.0, SIGMA)


@pytest.fixture(scope="module")
def dry() -> Selection:
    """What a selection hands over that has found the dry friction of recordings."""
    records = rubbing(lambda speed: 20.0)
    bench = Bench(model(ONE_MASS), records, everything(records))
    retuned = bench.fit(NOTHING)
    return outcome(retuned, COULOMB, bench.fit(COULOMB, retuned), unnamed=None, remaining=None)


def test_fits_that_converged_are_not_spoken_of(dry: Selection) -> None:
    judged = judge(dry, SIGMA)
    assert judged.verdict is Verdict.EXPLAINED
    assert judged.unconverged == unconverged(dry) == ()


@pytest.mark.parametrize("which", ["retuned", "result"])
def test_nothing_is_explained_by_one_that_did_not(dry: Selection, which: str) -> None:
    restless = replace(dry, **{which: replace(getattr(dry, which), converged=False)})
    judged = judge(restless, SIGMA)
    assert judged.verdict is Verdict.UNEXPLAINED
    assert judged.objection == "dry friction at the motor rests on a fit that did not converge"
    assert len(judged.unconverged) == 1


def test_which_fit_it_was_is_said(dry: Selection) -> None:
    result = replace(dry.result, converged=False)
    restless = replace(dry, retuned=replace(dry.retuned, converged=False), result=result)
    first, second = unconverged(restless)
    assert first.startswith("The fit of the re-tuned nominal model did not converge: its error is an")
    assert second.startswith("The fit of the model with dry friction at the motor did not converge: its")
    said = statement(judge(restless, SIGMA), (), FIGURES, ())
    assert first in said
    assert second in said


def test_a_nominal_model_within_the_noise_needs_no_more_steps(dry: Selection) -> None:
    """Its error is an upper bound, and that is below the noise."""
    alone = outcome(replace(dry.retuned, converged=False), NOTHING, dry.retuned, unnamed=None, remaining=None)
    judged = judge(alone, dry.retuned.rms)
    assert judged.verdict is Verdict.NO_MISMATCH
    assert len(judged.unconverged) == 1
