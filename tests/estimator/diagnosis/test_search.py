"""The search: where samples were taken off their time, what is named must be seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import search as search_module
from estimator.diagnosis.chain import read_through
from estimator.diagnosis.hypotheses import NOTHING, Effects
from estimator.diagnosis.search import Search, hardly_seen, is_shaken, search
from estimator.signals.record import Record
from tests.estimator.diagnosis.planted import rubbing
from tests.estimator.physics.bench import ONE_MASS, model

FRICTION: Effects = frozenset({"coulomb_friction_motor"})
JITTER_S = 2e-3


def shaken(records: list[Record]) -> list[Record]:
    """The same, read at instants that no stamp tells."""
    rng = np.random.default_rng(4)

    def late(record: Record) -> Record:
        offset_s = JITTER_S * rng.standard_normal(record.output.size)
        return replace(record, output=record.output + offset_s * np.gradient(record.output, record.sample_time_s))

    return [late(record) for record in records]


def searched(records: list[Record]) -> Search:
    return search(read_through(records), model(ONE_MASS), (), lambda what, share: None)


def test_on_time_a_friction_that_is_hardly_seen_is_named() -> None:
    found = searched(rubbing(lambda speed: 0.5))
    assert found.selection.chosen == FRICTION
    assert hardly_seen("coulomb_friction_motor", found)
    assert not is_shaken(found)


def test_off_time_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    records = shaken(rubbing(lambda speed: 0.5))
    found = searched(records)
    assert is_shaken(found)
    assert found.selection.chosen == NOTHING
    monkeypatch.setattr(search_module, "is_shaken", lambda found: False)
    assert searched(records).selection.chosen == FRICTION


def test_off_time_a_friction_that_is_seen_is_named() -> None:
    found = searched(shaken(rubbing(lambda speed: 1.5)))
    assert is_shaken(found)
    assert found.selection.chosen == FRICTION
    assert not hardly_seen("coulomb_friction_motor", found)
