"""A step is distinguished from its moment on, whichever way round a fit found it."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.fit import fit
from estimator.physics.problem import make_problem
from estimator.physics.steps import from_their_moment, has_edge, moments_of
from estimator.physics.unknowns import effect_unknowns, nominal_unknowns
from estimator.signals.record import Record
from tests.estimator.physics.bench import TWO_MASS, model
from tests.estimator.physics.cracking import (
    AT_S,
    CHANGE,
    CRACK,
    LAST_S,
    SIGMA,
    SOUND,
    cracking,
    the_other_way_round,
)


@pytest.fixture(scope="module")
def records() -> list[Record]:
    """One cracks at 4 s and one has cracked before."""
    return [cracking(1, AT_S, LAST_S), cracking(2, 0.0, LAST_S)]


class TestFromTheirMoment:
    def test_what_was_stiffer_before_is_softer_after(self, records: list[Record]) -> None:
        found = the_other_way_round(SOUND, records, [(0.0, AT_S), (0.0, 0.0)])
        assert found.value(CRACK, "change") == pytest.approx(1.0 / (1.0 + CHANGE) - 1.0, rel=0.02)
        reported = from_their_moment(found, SOUND)
        assert reported.value(CRACK, "change") == pytest.approx(CHANGE, rel=0.02)
        assert reported.value("", "k") == pytest.approx(TWO_MASS["k"], rel=0.01)
        assert reported.rms == pytest.approx(SIGMA, rel=0.05)
        first, second = moments_of(reported, CRACK)
        assert first == pytest.approx((AT_S, LAST_S), abs=0.02)
        assert second == pytest.approx((0.0, LAST_S))

    @pytest.mark.parametrize("found_s", [(7.0, 7.3), (0.7, 3.0)], ids=["an instant", "all but its beginning"])
    def test_one_found_to_come_and_go_is_sought_again_from_the_other_side(self, found_s: tuple[float, float]) -> None:
        records = [cracking(1, AT_S, LAST_S), cracking(2, 5.0, LAST_S), cracking(3, 3.0, LAST_S)]
        reported = from_their_moment(the_other_way_round(SOUND, records, [(0.0, AT_S), (0.0, 5.0), found_s]), SOUND)
        assert reported.value(CRACK, "change") < 0.0
        began_s, ended_s = moments_of(reported, CRACK)[2]
        assert ended_s == pytest.approx(LAST_S)
        assert ended_s - began_s > found_s[1] - found_s[0]

    def test_a_nominal_value_trusted_exactly_decides(self) -> None:
        """Where the nominal shaft is the soft one, it was stiffer before."""
        soft = model({**TWO_MASS, "k": (1.0 + CHANGE) * TWO_MASS["k"]}, tolerance=0.05)
        release = effect_unknowns(CRACK, soft, [cracking(1, AT_S, LAST_S)])[0]
        own = [tuple(replace(u, start=at) for u, at in zip(release.own[0], (0.0, AT_S), strict=True))]
        start = tuple(replace(unknown, start=0.25) for unknown in release.shared)
        found = fit(make_problem(soft, [cracking(1, AT_S, LAST_S)], (*nominal_unknowns(soft), *start), own=own))
        assert found.rms == pytest.approx(SIGMA, rel=0.05)
        assert from_their_moment(found, soft) is found


@pytest.mark.parametrize(("ended_s", "is_event"), [(3.01, False), (4.0, True)])
def test_a_glimpse_of_an_event_next_to_a_whole_recording_is_none(
    records: list[Record], ended_s: float, is_event: bool
) -> None:
    """Of two vehicles one is stiffer all along: a sample of that in the other's recording makes it no change."""
    result = the_other_way_round(SOUND, records, [(3.0, 3.0), (0.0, LAST_S)])
    local = [result.local_of(i).copy() for i in range(2)]
    for i, moments in enumerate([(3.0, ended_s), (0.0, LAST_S)]):
        local[i][result.problem.local[i].own_rows] = moments
    x = np.concatenate([result.x[: len(result.problem.shared)], *local])
    assert has_edge(CRACK, replace(result, x=x)) is is_event
