"""What a round fits."""

from __future__ import annotations

import pytest

from estimator.diagnosis.hypotheses import NOTHING
from estimator.diagnosis.screening import Look, Screen
from estimator.physics.unknowns import Release
from tests.estimator.diagnosis.planted import quiet
from tests.estimator.diagnosis.selection.mass import COULOMB, rounds
from tests.estimator.physics.bench import ONE_MASS


def test_what_lets_a_pressed_parameter_go_is_fitted_whatever_a_look_promises(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring in the line takes its damping below what it is trusted to; a look along its size shows nothing of it."""
    tried = rounds(quiet(values=ONE_MASS, samples=600), [COULOMB, "extra_torsional_mode"])
    monkeypatch.setattr(Screen, "looks", lambda *_: [Look(Release((), ()), 0.0)])
    current = tried.jury.bench.fit(NOTHING)
    for pressed, looked_at in ((frozenset(), set()), (frozenset({"c"}), {"extra_torsional_mode"})):
        monkeypatch.setattr("estimator.diagnosis.selection.rounds.pressed_parameters", lambda _, found=pressed: found)
        assert set(tried._looks(tried.jury.names, NOTHING, current)) == looked_at
