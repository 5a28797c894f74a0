"""A step is told from its moment on, whichever way round a fit found it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.effect import Step
from estimator.physics.fit import FitResult, fit, make_problem
from estimator.physics.layout import flat, slot
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import Start, grid_for, simulate
from estimator.physics.steps import from_their_moment, inside, moments_of
from estimator.physics.unknowns import Shared, effect_unknowns, nominal_unknowns
from estimator.signals.record import Record
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

CRACK, SIGMA, SAMPLES = "stiffness_change", 0.02, 900
LAST_S = (SAMPLES - 1) * 0.01
CHANGE, AT_S = -0.2, 4.0
SOUND = model(TWO_MASS, tolerance=0.5)


def cracking(seed: int, from_s: float, to_s: float) -> Record:
    """A shaft that is softer for a while; simulated by the law that is fitted, what is tested is how it is told."""
    line = model(TWO_MASS, effects={CRACK: {"change": CHANGE}})
    torque = random_steps(SAMPLES, seed, mean_nm=30.0)
    blank = record(torque, np.ones(SAMPLES), name=f"run_{seed}")
    p = flat(line)
    p[slot(CRACK, "from_s")], p[slot(CRACK, "to_s")] = from_s, to_s
    clean = simulate(grid_for(line, [blank]), blank, p, Start(10.0, 0.0, 20.0, 0.005, 20.0))
    return replace(blank, output=clean + SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES))


def the_other_way_round(line: DrivelineModel, records: list[Record], moments: list[tuple[float, float]]) -> FitResult:
    """Fit from a shaft that is nominally soft, and stiffer until the moment."""
    release = effect_unknowns(CRACK, line, records)[0]
    starts = {"k": 1.0 + CHANGE, "change": 1.0 / (1.0 + CHANGE) - 1.0}

    def begun(unknown: Shared) -> Shared:
        return replace(unknown, start=starts.get(unknown.name, unknown.start))

    own = [
        tuple(
            replace(
                u,
                start=at,
                low=max(u.low, at - 0.3) if ends > begins else at,
                high=min(u.high, at + 0.3) if ends > begins else at,
            )
            for u, at in zip(unknowns, (begins, ends), strict=True)
        )
        for unknowns, (begins, ends) in zip(release.own, moments, strict=True)
    ]
    shared = tuple(begun(unknown) for unknown in (*nominal_unknowns(line), *release.shared))
    return fit(make_problem(line, records, shared, own=own))


@pytest.fixture(scope="module")
def records() -> list[Record]:
    """One cracks at 4 s and one has cracked before."""
    return [cracking(1, AT_S, LAST_S), cracking(2, 0.0, LAST_S)]


class TestFromTheirMoment:
    def test_what_was_stiffer_before_is_softer_after(self, records: list[Record]) -> None:
        found = the_other_way_round(SOUND, records, [(0.0, AT_S), (0.0, 0.0)])
        assert found.value(CRACK, "change") == pytest.approx(1.0 / (1.0 + CHANGE) - 1.0, rel=0.02)
        told = from_their_moment(found, SOUND)
        assert told.value(CRACK, "change") == pytest.approx(CHANGE, rel=0.02)
        assert told.value("", "k") == pytest.approx(TWO_MASS["k"], rel=0.01)
        assert told.rms == pytest.approx(SIGMA, rel=0.05)
        first, second = moments_of(told, CRACK)
        assert first == pytest.approx((AT_S, LAST_S), abs=0.02)
        assert second == pytest.approx((0.0, LAST_S))

    def test_told_from_its_moment_it_stays(self, records: list[Record]) -> None:
        told = from_their_moment(the_other_way_round(SOUND, records, [(0.0, AT_S), (0.0, 0.0)]), SOUND)
        assert from_their_moment(told, SOUND) is told

    def test_a_nominal_value_trusted_exactly_decides(self) -> None:
        """Where the nominal shaft is the soft one, it was stiffer before."""
        soft = model({**TWO_MASS, "k": (1.0 + CHANGE) * TWO_MASS["k"]}, tolerance=0.05)
        release = effect_unknowns(CRACK, soft, [cracking(1, AT_S, LAST_S)])[0]
        own = [tuple(replace(u, start=at) for u, at in zip(release.own[0], (0.0, AT_S), strict=True))]
        start = tuple(replace(unknown, start=0.25) for unknown in release.shared)
        found = fit(make_problem(soft, [cracking(1, AT_S, LAST_S)], (*nominal_unknowns(soft), *start), own=own))
        assert found.rms == pytest.approx(SIGMA, rel=0.05)
        assert from_their_moment(found, soft) is found


def test_a_moment_at_an_end_is_not_inside() -> None:
    rec = record(np.zeros(SAMPLES), np.zeros(SAMPLES))
    assert [inside(rec, moment_s) for moment_s in (0.2, 0.6, 8.0, 8.9)] == [False, True, True, False]


@pytest.mark.parametrize(("relative", "size"), [(True, -0.2), (True, 0.3), (False, 12.0)])
def test_turned_twice_a_step_is_itself(relative: bool, size: float) -> None:
    step = Step(lambda _model: "k", relative)
    assert step.turned(*step.turned(50.0, size)) == pytest.approx((50.0, size))
