"""The pursuit takes what re-tuning can't explain, and no more coefficients than it is worth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from estimator.diagnosis.unnamed.forms import Pool, candidates, pursue
from estimator.diagnosis.unnamed.scene import Ground, ground_of, scene
from estimator.physics.effect import Element
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.planted import SIGMA, nominal_fit, quiet


def pool_of(answers: Sequence[FloatArray]) -> Pool:
    """Laws with these answers, shape (rows, q) each."""
    group = np.repeat(np.arange(len(answers)), [each.shape[1] for each in answers])
    return Pool(tuple(f"law {i}" for i in range(len(answers))), group, np.hstack(answers).T)


def test_what_re_tuning_explains_is_not_a_law() -> None:
    """A load inertia within its tolerance is d w_L/dt at the load: projected out, nothing is left of it."""
    result = nominal_fit(quiet((1,)))
    view = scene(result, SIGMA)
    ground = ground_of(view)
    pool = candidates(view, Element.LOAD)
    (inertia,) = (pool.of([i]) for i, law in enumerate(pool.laws) if law.startswith("dw_L/dt from 1.0 s"))
    drag = pool.of([pool.laws.index("w_L |w_L|")])
    assert np.linalg.norm(ground.rest(inertia)) < 0.3 * np.linalg.norm(inertia)
    assert np.linalg.norm(ground.rest(drag)) > 0.05 * np.linalg.norm(drag)
    free = ground.jacobian[:, ~result.pinned]
    assert np.max(np.abs(free.T @ ground.rest(drag))) < 1e-8 * np.max(np.abs(ground.jacobian)) * np.linalg.norm(drag)


def test_a_group_is_worth_its_coefficients_and_not_more() -> None:
    """Two columns that carry the error, one of them twice, among columns of noise: rank 2, not 3."""
    rng = np.random.default_rng(5)
    result = nominal_fit(quiet((1,)))
    plain = ground_of(scene(result, SIGMA))
    rows = plain.error.size
    signal = rng.standard_normal((rows, 2))
    noise = [rng.standard_normal((rows, 1)) for _ in range(20)]
    planted = np.column_stack([signal, signal[:, 0] - signal[:, 1]])
    error = signal @ np.array([0.1, -0.05]) + 0.02 * rng.standard_normal(rows)
    ground = Ground(scene(result, SIGMA).cut, plain.jacobian, error, result.pinned)
    path = pursue(pool_of([*noise[:10], planted, *noise[10:]]), ground)
    assert path.chosen == [10]
    assert path.coefficients == [0, 2]
    coefficients, left = path.solved(1, 1e-9)
    np.testing.assert_allclose(planted @ coefficients, signal @ [0.1, -0.05], atol=0.005)
    assert left @ left == pytest.approx(path.squares[1], rel=1e-6)
    assert left.std() == pytest.approx(0.02, rel=0.1)


def test_what_is_left_is_computed_and_not_promised(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the sweeps' rounding promised all of the error to a column that has nothing to do with it."""
    rng = np.random.default_rng(5)
    ground = ground_of(scene(nominal_fit(quiet((1,))), SIGMA))
    pool = pool_of([rng.standard_normal((ground.error.size, 1))])
    whole = float(ground.error @ ground.error)
    monkeypatch.setattr("estimator.diagnosis.unnamed.forms._gains", lambda *_: (np.array([whole]), np.array([1.0])))
    path = pursue(pool, ground)
    assert path.chosen == []
    assert path.squares == [pytest.approx(whole)]
