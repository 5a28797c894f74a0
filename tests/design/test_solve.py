"""When `hil solve` may end: what it drives where nothing seems to be missing."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from hil.design.solve import Solving
from hil.design.solve_state import Driven, End, SolveState
from tests.design.test_candidates import SOURCE

OWN = list(SOURCE.rig().experiments)


def solving(driven: list[str], given: list[Path], most_vehicle_s: float = 600.0) -> Solving:
    """A search that has driven so much and neither runner nor operator."""
    state = SolveState("hil.solve/1", "", "", [Driven(name, {}, "x.csv", 40.0, 0.0, None, None) for name in driven])
    nobody: Any = SimpleNamespace()
    return Solving(
        *(Path(), SOURCE, nobody, Path(), nobody, nobody, state, given, "quick", most_vehicle_s, 0.0),
        *(print, print, lambda *_: None),
    )


def decided_on(*effects: str) -> Any:
    """What a diagnosis leaves open: nothing; it names these effects."""
    candidate = SimpleNamespace(effects=frozenset(effects))
    return cast("Any", SimpleNamespace(is_decided=True, named=frozenset(effects), untested=(), candidates=(candidate,)))


def test_nothing_missing_is_decided_when_the_rigs_own_experiments_are_all_driven() -> None:
    """A brake that drags for some seconds was in none of two short runs, and 'decided' was wrong."""
    for count, name in enumerate(OWN):
        assert solving(OWN[:count], [])._next(decided_on())[:1] == (name,)  # type: ignore[index]
    assert solving(OWN, [])._next(decided_on()) is End.DECIDED


@pytest.mark.parametrize(("effects", "given"), [(("backlash",), []), ((), [Path("a.csv")])])
def test_a_name_and_recordings_that_were_given_decide(effects: tuple[str, ...], given: list[Path]) -> None:
    assert solving(OWN[:1], given)._next(decided_on(*effects)) is End.DECIDED


def test_no_experiment_goes_beyond_the_vehicles_time() -> None:
    job = solving(OWN[:1], [], most_vehicle_s=50.0)
    job.runner = cast("Any", SimpleNamespace(predict=lambda *_: SimpleNamespace(seconds=20.0)))
    job.file = cast("Any", SimpleNamespace(model=None))
    assert job._drive(OWN[1], {}) is End.TIME


def test_odds_that_contradict_the_verdict_are_no_decision() -> None:
    known = decided_on()
    known.is_decided = False
    assert solving(OWN, [])._next(known) is End.NOTHING_DECIDES
