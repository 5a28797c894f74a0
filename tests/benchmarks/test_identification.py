"""The identification benchmarks judge what they say; small forms of the campaigns."""

import math

import numpy as np
import pytest

from tests.benchmarks.buses import CLEAN, ON_THE_ROAD, draw_bus, drive
from tests.benchmarks.identification.bound import least_errors
from tests.benchmarks.identification.methods import BAND_HZ, PEERS, Answer, Case, Interval, Peer, make_case, of_poles
from tests.benchmarks.identification.rigs import buses, cruises, experiment
from tests.benchmarks.identification.run import Judged, judge
from tests.benchmarks.identification.scores import coverages, errors, tables

TRUTH = {"frequency": 8.0, "damping": 0.05}


def poles_of(frequency_hz: float, damping: float) -> list[complex]:
    """Return the pair in z at 10 ms."""
    s = 2 * math.pi * frequency_hz * complex(-damping, math.sqrt(1 - damping**2))
    z = complex(np.exp(s * 0.01))
    return [z, z.conjugate()]


def said(frequency_hz: float, damping: float = 0.05, intervals: dict[str, Interval] | None = None) -> Judged:
    """Return a bus about which one method said this."""
    return Judged(7, TRUTH, {"m": Answer(frequency_hz, damping, intervals or {}, cpu_s=0.2)}, (0.001, 0.01))


@pytest.fixture(scope="module")
def road_case() -> Case:
    return make_case(1, ON_THE_ROAD)


@pytest.fixture(scope="module")
def judged() -> Judged:
    return judge(3, CLEAN)


def test_the_least_damped_pair_in_the_band_is_the_answer() -> None:
    slow, seen, other = poles_of(BAND_HZ[0] / 2, 0.01), poles_of(8.0, 0.05), poles_of(15.0, 0.3)
    found = of_poles(np.array([*slow, *seen, *other, 0.99]))
    assert (found.frequency_hz, found.damping) == pytest.approx((8.0, 0.05))


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_every_peer_finds_the_resonance_of_a_bus_on_the_road(peer: Peer, road_case: Case) -> None:
    if not peer.is_installed:
        pytest.skip(f"pip install {peer.requirement}")
    found = peer(road_case)
    assert found.frequency_hz == pytest.approx(road_case.truth["frequency"], rel=0.01)
    assert found.damping == pytest.approx(road_case.truth["damping"], rel=0.1)


@pytest.mark.campaign
def test_every_method_is_asked_about_a_bus_and_reported_in_the_tables(judged: Judged) -> None:
    text = tables([judged])
    assert judged.seed == 3
    assert all(name in text for name in judged.answers)
    assert all(answer.cpu_s > 0.0 for answer in judged.answers.values())
    best = judged.answers["this project: Box-Jenkins, 10 ms"]
    assert best.frequency_hz == pytest.approx(judged.truth["frequency"], rel=0.005)
    assert set(judged.truth) <= set(best.intervals)  # and sums of parameters, whose truth follows


def test_the_least_error_falls_with_the_root_of_the_time_and_with_the_noise() -> None:
    bus = draw_bus(5)
    least = {
        (seconds, world): np.array(
            least_errors(Case(bus, drive(bus, seconds, world=world), *(np.zeros(1),) * 2), world)
        )
        for seconds, world in ((15.0, ON_THE_ROAD), (60.0, ON_THE_ROAD), (15.0, CLEAN))
    }
    assert least[15.0, ON_THE_ROAD] / least[60.0, ON_THE_ROAD] == pytest.approx([2.0, 2.0], rel=0.15)
    assert (least[15.0, CLEAN] < least[15.0, ON_THE_ROAD]).all()


def test_errors_are_those_of_the_buses_answered_for() -> None:
    found = errors([said(8.08), said(7.96, 0.055), Judged(9, TRUTH, {"m": Answer(cpu_s=0.4)}, (0.001, 0.01))], "m")
    assert found.frequency_rms == pytest.approx(math.sqrt((1.0 + 0.25) / 2))
    assert found.damping_rms == pytest.approx(math.sqrt(100 / 2))
    assert (found.frequency_worst, found.damping_worst, found.cpu_s) == pytest.approx((1.0, 10.0, 0.2))
    assert (found.none.held, found.none.runs) == (1, 3)


def test_coverage_counts_what_the_intervals_hold() -> None:
    holding, above = Interval(8.01, 7.99, 8.03), Interval(8.1, 8.05, 8.15)
    impossible, unsure = Interval(-0.1, -0.2, -0.05), Interval(0.01, -0.1, 0.2, is_determined=False)
    printed = [{"frequency": holding}, {"frequency": above, "damping": impossible}, {"damping": unsure}]
    frequency, damping = coverages([said(8.0, intervals=intervals) for intervals in printed], "m")
    assert (frequency.held.held, frequency.held.runs, frequency.refused, frequency.impossible) == (1, 2, 1, 0)
    assert (damping.held.held, damping.held.runs, damping.impossible) == (1, 2, 1)
    assert (damping.held_determined.held, damping.held_determined.runs) == (0, 1)
    assert frequency.error_rms == pytest.approx(100 * math.sqrt((0.01**2 + 0.1**2) / 2) / 8)


@pytest.mark.campaign
def test_experiments_keep_the_limits_on_both_simulators() -> None:
    for source in (cruises, buses):
        for truth in source(1):
            assert experiment(truth).is_good
