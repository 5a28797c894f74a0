"""Sets of effects in free simulation: which needs no second look, and how much one needs what another lacks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from estimator.diagnosis.inference.decide import needed_beyond
from estimator.diagnosis.inference.hypotheses import GRADE, Hypothesis
from estimator.diagnosis.inference.trials import Trial, blocks, necessity, quantile, size_of
from estimator.diagnosis.thresholds import Judging
from estimator.physics.effects.load import KNOT_SPACING_S
from estimator.physics.fit import FitResult
from tests.estimator.physics.bench import record

SAMPLES = 10.0  # in each block


@dataclass(frozen=True)
class Made:
    """A set of effects with a score, of which nothing was fitted."""

    effects: frozenset[str]
    score: float


def trial(names: str, squares: Sequence[float], score: float = 0.0) -> Trial:
    made = cast(Hypothesis, Made(frozenset(names.split()), score))
    of_blocks = np.asarray(squares, dtype=float)
    return Trial(made, len(names.split()), cast(FitResult, None), of_blocks, np.full(of_blocks.size, SAMPLES))


def test_the_free_run_error_is_that_of_all_blocks() -> None:
    assert trial("lag", [10.0, 30.0]).rms == pytest.approx(math.sqrt(2.0))
    assert trial("lag", [10.0, 30.0]).excess(0.5) == pytest.approx([7.5, 27.5])


def test_a_set_is_clearly_better_that_gains_more_than_its_blocks_scatter() -> None:
    """Gains of 1 and 3 in four blocks: their sum is 8, its standard error sqrt(4) * sqrt(4 / 3)."""
    before, sure = trial("", [5.0, 5.0, 5.0, 5.0]), trial("lag", [4.0, 2.0, 4.0, 2.0])
    assert 8.0 > quantile(4) * math.sqrt(4.0 * 4.0 / 3.0)
    assert sure.clearly_beats(before)
    by_one_block = trial("lag", [9.0, 5.0, 5.0, -7.0])  # 8 in all, scattered by sqrt(4) * sqrt(36)
    assert not by_one_block.clearly_beats(before)
    assert not before.clearly_beats(before)


def test_a_set_beats_a_larger_one_that_simulates_no_better_and_one_of_as_many_that_is_clearly_worse() -> None:
    small, same, larger = trial("lag", [4.0, 4.0]), trial("brake", [5.0, 4.0]), trial("lag brake", [4.0, 4.0])
    assert small.beats(larger)
    assert not larger.beats(small)
    assert not small.beats(same)  # by one block alone
    assert small.beats(trial("brake", [6.0, 6.1]))
    assert not trial("lag", [4.0, 4.1]).beats(larger)


def test_a_course_of_the_load_counts_for_several_laws() -> None:
    assert size_of(frozenset({"backlash"})) == 1
    assert size_of(frozenset({"backlash", GRADE})) == 1 + Judging.COURSE


def test_a_set_needs_what_brings_the_error_beyond_the_noise_back() -> None:
    """Blocks of 10 samples at a noise of 0.5 hold 2.5: of 10 and 10 beyond it are left 1 and 3.

    The ratio is 4 / 20 = 0.2; the residuals of the blocks are 1 - 2 and 3 - 2, their sum has a standard error of
    sqrt(2) * sqrt(2), the ratio one of that over 20.
    """
    found = necessity(trial("lag", [3.5, 5.5]), trial("", [12.5, 12.5]), 0.5)
    assert found.value == pytest.approx(0.8)
    assert found.least == pytest.approx(0.8 - quantile(2) * 2.0 / 20.0)


@pytest.mark.parametrize(
    ("whole", "without"),
    [
        ([2.0, 2.0], [2.4, 2.5]),  # without it there is no more than noise
        ([9.0, 9.0], [8.0, 9.0]),  # it leaves more
        ([9.0, 9.0], [9.0, 9.0]),
    ],
)
def test_what_simulates_no_worse_without_is_not_needed(whole: list[float], without: list[float]) -> None:
    found = necessity(trial("lag", whole), trial("", without), 0.5)
    assert (found.value, found.least) == (0.0, 0.0)


def test_what_is_down_to_the_noise_is_needed_wholly() -> None:
    """An error below the noise is no more than all of it."""
    assert necessity(trial("lag", [2.0, 2.0]), trial("", [12.5, 12.5]), 0.5).value == 1.0


def test_a_larger_set_is_needed_only_where_half_of_the_error_goes_with_it() -> None:
    nothing = trial("", [100.0] * 4, 100.0)
    lag, both = trial("lag", [20.0] * 4, 50.0), trial("lag brake", [15.0] * 4, 10.0)
    assert needed_beyond(nothing, [nothing, lag, both], 0.0) is lag
    assert needed_beyond(lag, [nothing, lag, both], 0.0) is None  # a quarter of the error, however probable
    more = trial("lag brake", [5.0] * 4, 10.0)
    assert Judging.LEAST_NECESSITY < 0.75
    assert needed_beyond(lag, [nothing, lag, more], 0.0) is more


def test_no_set_is_taken_that_is_less_probable_or_that_another_one_beats() -> None:
    nothing = trial("", [100.0] * 4, 100.0)
    assert needed_beyond(nothing, [nothing, trial("lag", [20.0] * 4, 120.0)], 0.0) is None
    wrong, right = trial("lag", [20.0] * 4, 20.0), trial("filter", [2.0] * 4, 50.0)
    assert needed_beyond(nothing, [nothing, wrong, right], 0.0) is right  # it simulates better, less probable or not


def test_of_several_sets_that_simulate_alike_the_most_probable_is_taken() -> None:
    nothing = trial("", [100.0] * 4, 100.0)
    one, other = trial("lag", [2.0, 2.1, 2.0, 2.0], 30.0), trial("filter", [2.0, 2.0, 2.0, 2.1], 20.0)
    assert needed_beyond(nothing, [nothing, one, other], 0.0) is other


def test_blocks_are_held_out_all_along_and_none_at_the_ends() -> None:
    out = blocks(record(np.zeros(2000), np.zeros(2000)))
    assert out.mean() == pytest.approx(Judging.BLOCK_S / Judging.EVERY_S, abs=0.01)
    assert not out[0]
    assert not out[-1]
    short = blocks(record(np.zeros(100), np.zeros(100)))
    assert short.mean() == pytest.approx(Judging.BLOCK_S / Judging.EVERY_S, abs=0.05)
    assert np.count_nonzero(np.diff(short.astype(int)) == 1) == Judging.FEWEST_BLOCKS
    assert Judging.BLOCK_S < KNOT_SPACING_S  # so that the profile on both sides can predict it
