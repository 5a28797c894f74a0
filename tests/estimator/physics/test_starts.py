"""A fit from several starts takes the best, and one from where another ended begins with what that one found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.driveline import Start
from estimator.physics.fit import best_fit, fit, warm_start
from estimator.physics.layout import slot
from estimator.physics.problem import local_part, make_problem, parameters, start_of
from estimator.physics.unknowns import effect_unknowns, nominal_unknowns
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps
from tests.estimator.physics.test_fit import SIGMA, STARTS, TRUE, nominal_problem, recordings


def test_of_several_starts_the_best_counts() -> None:
    """Under a square wave of ten samples a delay of eight looks like two too early: small starts end at zero."""
    torque = 100.0 * np.tile(np.repeat([1.0, -1.0], 5), 60)
    late = np.concatenate([np.full(8, torque[0]), torque[:-8]])
    rec = replace(linear_record(ONE_MASS, late, Start(0.0, 0.0, 0.0), sigma=0.01), torque_nm=torque[:, None])
    line = model(ONE_MASS)
    problems = [
        make_problem(line, [rec], (*nominal_unknowns(line), *release.shared))
        for release in effect_unknowns("transport_delay", line, [rec])
    ]
    alone = [fit(problem).value("transport_delay", "delay_s") for problem in problems]
    assert alone[0] == pytest.approx(0.0, abs=1e-9)
    assert best_fit(problems).value("transport_delay", "delay_s") == pytest.approx(0.08, abs=1e-3)


def test_a_warm_start_begins_where_the_last_fit_ended() -> None:
    records = recordings()
    line = model(TWO_MASS)
    warm = fit(nominal_problem(records))
    delay = effect_unknowns("transport_delay", line, records)[0].shared
    problem = make_problem(line, records, (*nominal_unknowns(line), *delay), profile=True)
    x = warm_start(problem, warm)
    p = parameters(problem, x)
    for shared in warm.problem.shared:
        assert p[shared.slot] == pytest.approx(warm.value("", shared.name))
    assert p[slot("transport_delay", "delay_s")] == delay[0].start * delay[0].scale
    for i in range(2):
        assert start_of(problem, x, i) == start_of(warm.problem, warm.x, i)
        assert not problem.local[i].extra_load(local_part(problem, x, i)).any()


def test_a_warm_start_from_other_recordings_keeps_values_not_scaled_unknowns() -> None:
    """The scale of an effect's parameter is read off the recordings."""
    line = model(TWO_MASS)
    large = recordings()
    small = [linear_record(TRUE, random_steps(400, 5, size_nm=10.0), STARTS["first"], sigma=SIGMA, name="small")]
    gaps = [effect_unknowns("backlash", line, recs)[1].shared for recs in (large, small)]
    shared = [(*nominal_unknowns(line), *gap) for gap in gaps]
    assert gaps[0][0].scale == pytest.approx(10.0 * gaps[1][0].scale)
    warm = fit(make_problem(line, large, shared[0]))
    problem = make_problem(line, small, shared[1])
    carried = parameters(problem, warm_start(problem, warm))
    np.testing.assert_allclose(carried, warm.p)
