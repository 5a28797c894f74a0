"""When `hil solve` may end: what it drives where nothing seems to be missing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from hil.design.solve import Solving
from hil.design.solve_state import STATE, Driven, End, Odds, SolveState
from hil.orders.operator import Answer, StepChoice
from hil.orders.runner import SpeedBandLeft
from tests.design.test_candidates import SOURCE

OWN = list(SOURCE.rig().experiments)


def solving(driven: list[str], given: list[Path], most_vehicle_s: float = 600.0, done: Sequence[str] = ()) -> Solving:
    """A search that has driven so much and neither runner nor operator; ``done`` is what the given recordings are."""
    state = SolveState("hil.solve/1", "", "", [Driven(name, {}, "x.csv", 40.0, 0.0, None, None) for name in driven])
    nobody: Any = SimpleNamespace()
    return Solving(
        *(Path(), SOURCE, nobody, Path(), nobody, nobody, state, given, "quick", most_vehicle_s, 0.0),
        *(print, print, lambda *_: None),
        done=done,
    )


def decided_on(*effects: str) -> Any:
    """What a diagnosis leaves open: nothing; it names these effects."""
    candidate = SimpleNamespace(effects=frozenset(effects))
    return cast(
        "Any",
        SimpleNamespace(is_decided=True, named=frozenset(effects), untested=(), candidates=(candidate,), unnamed=None),
    )


def test_nothing_missing_is_decided_when_the_rigs_own_experiments_are_all_driven() -> None:
    """A brake that drags for some seconds was in none of two short runs, and 'decided' was wrong."""
    for count, name in enumerate(OWN):
        assert solving(OWN[:count], [])._next(decided_on())[:1] == (name,)  # type: ignore[index]
    assert solving(OWN, [])._next(decided_on()) is End.DECIDED


def test_a_name_decides_whatever_was_driven() -> None:
    assert solving(OWN[:1], [])._next(decided_on("backlash")) is End.DECIDED


def test_recordings_that_were_given_count_as_the_experiments_that_they_are_of() -> None:
    assert solving([], [Path("a.csv")], done=OWN)._next(decided_on()) is End.DECIDED
    assert solving([], [Path("a.csv")])._next(decided_on())[:1] == (OWN[0],)  # type: ignore[index]


def stopped(error: BaseException) -> Solving:
    """A search in which the first experiment of the rig file was driven whole, and the second one ended early."""
    job = solving(OWN[:1], [])
    job.state.statement = "Nothing is missing."
    job.file, job.keep = cast("Any", SimpleNamespace(model=None)), lambda _document: None
    job.may_command = lambda _name: Answer(StepChoice.GO)

    def run(*_: object) -> None:
        raise error

    ranges = {name: SimpleNamespace(low=0.0, high=1.0) for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s")}
    prediction = SimpleNamespace(seconds=20.0, **ranges)
    job.runner = cast("Any", SimpleNamespace(predictions=lambda *_: [prediction], run=run, folder=Path()))
    with pytest.raises(type(error)):
        job._drive(OWN[1], {})
    return job


def test_what_left_its_band_of_speed_is_reported_and_left_out_by_the_next_call(
    capsys: pytest.CaptureFixture[str],
) -> None:
    job = stopped(SpeedBandLeft("speed band: -2.4 rad/s"))
    said = capsys.readouterr().out
    assert f"{OWN[1]} was ended early. Nothing is missing." in said
    assert f"continues from what was recorded whole (1), and leaves {OWN[1]} out" in said
    assert job.state.because == f"{OWN[1]} was ended early: speed band: -2.4 rad/s"
    state = STATE.validate_python(job.document())
    job.state = state
    assert job._next(decided_on())[:1] == (OWN[2],)  # type: ignore[index]
    job.state.driven += [Driven(name, {}, "x.csv", 40.0, 0.0, None, None) for name in OWN[2:]]
    assert job._next(decided_on()) is End.NOTHING_DECIDES
    assert OWN[1] in job.state.because


def test_what_was_interrupted_is_driven_again() -> None:
    assert stopped(KeyboardInterrupt())._next(decided_on())[:1] == (OWN[1],)  # type: ignore[index]


def test_no_experiment_goes_beyond_the_vehicles_time() -> None:
    job = solving(OWN[:1], [], most_vehicle_s=50.0)
    job.runner = cast("Any", SimpleNamespace(predictions=lambda *_: [SimpleNamespace(seconds=20.0)]))
    job.file = cast("Any", SimpleNamespace(model=None))
    assert job._drive(OWN[1], {}) is End.TIME


def test_odds_that_contradict_the_verdict_are_no_decision() -> None:
    known = decided_on()
    known.is_decided = False
    assert solving(OWN, [])._next(known) is End.NOTHING_DECIDES


@pytest.mark.parametrize(("promised", "ends"), [((0.99, 0.95), True), ((0.99, 0.6), False), ((0.99,), False)])
def test_what_stays_open_against_the_promise_of_two_experiments_is_driven_no_further(
    monkeypatch: pytest.MonkeyPatch, promised: tuple[float, ...], ends: bool
) -> None:
    """A law of another form leaves each explanation a part of what it is, in every experiment anew."""
    planned = SimpleNamespace(name="a", table={})
    design = SimpleNamespace(planned=planned, shows=(), decides=SimpleNamespace(), is_worth_driving=True)
    monkeypatch.setattr(Solving, "_designed", lambda *_: design)
    job = solving([], [Path("x.csv")])
    job.state.driven = [Driven(f"{i}", {}, "x.csv", 40.0, 0.0, 100.0, right) for i, right in enumerate(promised)]
    odds = {"stribeck_friction": 0.5, "extra_torsional_mode + stribeck_friction": 0.5}
    job.state.odds = [Odds(count, odds) for count in range(1, len(promised) + 2)]
    known = decided_on("stribeck_friction")
    known.is_decided, known.untested = False, ("backlash",)
    known.candidates = tuple(SimpleNamespace(name=name) for name in odds)
    found = job._next(known)
    assert (found is End.NOTHING_DECIDES) is ends
    assert ("Stribeck friction at the motor did not: what is there has another form" in job.state.because) is ends
    design.decides = None  # it is for the law that has no name
    assert job._next(known) is not End.NOTHING_DECIDES
    design.decides = SimpleNamespace()
    job.state.odds[-1] = Odds(3, {"stribeck_friction": 0.96, "backlash": 0.04})  # something else is open by now
    assert job._next(known) is not End.NOTHING_DECIDES
