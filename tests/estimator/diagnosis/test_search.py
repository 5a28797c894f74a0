"""The search: what is named must be seen where samples were taken off their time, and stay on finer steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import search as search_module
from estimator.diagnosis.bench import Bench
from estimator.diagnosis.chain import Chain, read_through
from estimator.diagnosis.hypotheses import NOTHING, Effects, everything
from estimator.diagnosis.search import FINER, Search, is_made_by_steps, search
from estimator.diagnosis.selection import Selection, Selector
from estimator.diagnosis.selection.rounds import Rounds
from estimator.diagnosis.trial import Trial
from estimator.diagnosis.weight import VISIBLE
from estimator.physics.fit import FitResult
from estimator.physics.grid import Grid, grid_for
from estimator.signals.record import Record
from tests.estimator.diagnosis.planted import quiet, rubbing
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, model

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


def faults(found: Search) -> list[str]:
    return [finding.name for finding in found.chain.findings]


def test_on_time_a_friction_that_is_hardly_seen_is_named() -> None:
    found = searched(rubbing(lambda speed: 0.5))
    assert found.selection.chosen == FRICTION
    assert found.selection.retuned.rms < VISIBLE * found.selection.result.rms
    assert faults(found) == []


def test_off_time_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    records = shaken(rubbing(lambda speed: 0.5))
    found = searched(records)
    assert faults(found) == ["sample_jitter"]
    assert found.selection.chosen == NOTHING
    monkeypatch.setattr(Chain, "with_jitter_in", lambda chain, result: chain)
    assert searched(records).selection.chosen == FRICTION


def test_off_time_a_friction_that_is_seen_is_named() -> None:
    found = searched(shaken(rubbing(lambda speed: 1.5)))
    assert faults(found) == ["sample_jitter"]
    assert found.selection.chosen == FRICTION
    assert found.selection.retuned.rms > VISIBLE * found.selection.result.rms


def test_what_steps_too_coarse_draw_is_seen_on_finer_ones() -> None:
    records, line = quiet(), model(TWO_MASS)
    grid = grid_for(line, records)
    drawn = [
        is_made_by_steps(Bench(line, records, everything(records), replace(grid, substeps=steps)).fit(NOTHING))
        for steps in (1, grid.substeps)
    ]
    assert drawn == [True, False]


@pytest.mark.parametrize("holds", [True, False])
def test_where_steps_have_a_part_in_an_explanation_it_is_sought_on_finer_ones(
    holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From where it ended; anew, every effect looked at again, where it leaves more there."""
    records, said = rubbing(lambda speed: 1.5), list[str]()
    usual = searched(records).selection.result.problem.grid
    monkeypatch.setattr(search_module, "is_made_by_steps", lambda result: result.problem.grid == usual)
    if not holds:
        monkeypatch.setattr(Bench, "go_on_from", lambda bench, other: bench.fit(NOTHING))
    found = search(read_through(records), model(ONE_MASS), (), lambda what, share: said.append(what))
    assert found.selection.retuned.problem.grid == replace(usual, substeps=FINER * usual.substeps)
    assert found.selection.chosen == FRICTION
    assert found.selection.trials.keys() >= FRICTION
    assert said.count("looking at every effect") == (1 if holds else 2)


def test_where_steps_have_a_part_in_what_is_left_a_further_effect_is_sought_on_finer_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And not on the coarse ones before: what the first effect leaves there is not what it leaves."""
    records, rounds = rubbing(lambda speed: 2.0 + 0.2 * speed**2, (1, 2, 3)), list[tuple[Effects, Grid]]()
    usual = searched(records).selection.result.problem.grid
    finer = replace(usual, substeps=FINER * usual.substeps)
    try_all = Rounds.try_all

    def noted(self: Rounds, chosen: Effects, current: FitResult, *rest: Effects | float) -> dict[str, Trial]:
        rounds.append((chosen, current.problem.grid))
        return try_all(self, chosen, current, *rest)

    monkeypatch.setattr(Rounds, "try_all", noted)
    monkeypatch.setattr(search_module, "is_made_by_steps", lambda result: result.problem.grid == usual)
    found = searched(records)
    assert found.selection.chosen > FRICTION
    assert [(len(chosen), grid) for chosen, grid in rounds[:2]] == [(0, usual), (1, finer)]
    assert {grid for _, grid in rounds[1:]} == {finer}


def test_what_was_not_gone_on_from_for_its_steps_is_gone_on_from_on_finer_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where the steps have no part any more in what is left once moments are settled."""
    records, asked = rubbing(lambda speed: 2.0 + 0.2 * speed**2, (1, 2, 3)), list[Grid]()
    usual = searched(records).selection.result.problem.grid

    def at_first(result: FitResult) -> bool:
        asked.append(result.problem.grid)
        return len(asked) == 1

    monkeypatch.setattr(search_module, "is_made_by_steps", at_first)
    found = searched(records)
    assert found.selection.chosen > FRICTION
    assert found.selection.result.problem.grid == replace(usual, substeps=FINER * usual.substeps)
    assert asked == [usual]


def test_other_ways_are_gone_on_the_finer_steps_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the steps have a part in what is doubted, the search begins anew on finer ones anyway."""
    records, gone = rubbing(lambda speed: 1.5), list[Grid]()
    usual = searched(records).selection.result.problem.grid
    run, finer = Selector.run, replace(usual, substeps=FINER * usual.substeps)

    def forgotten(select: Selector) -> Selection:
        found = run(select)
        return replace(found, chosen=NOTHING, result=found.retuned, accepted={})

    def noted(select: Selector, selection: Selection) -> Selection:
        gone.append(selection.retuned.problem.grid)
        return selection

    monkeypatch.setattr(Selector, "run", forgotten)
    monkeypatch.setattr(Selector, "by_other_ways", noted)
    for by_steps, grids in ((True, [finer]), (False, [usual])):
        monkeypatch.setattr(search_module, "is_made_by_steps", lambda result, by_steps=by_steps: by_steps)
        search(read_through(records), model(ONE_MASS), (), lambda what, share: None)
        assert gone == grids
        gone.clear()
