"""Blocks that are hidden and judged: each with something measured on both sides."""

import numpy as np

from estimator.signals.record import Record
from hil.proof.real.held_out import inner_blocks

PERIOD_S, N = 0.1, 400


def record(okay):
    return Record("r", PERIOD_S, PERIOD_S * np.arange(N), np.ones((N, 1)), np.ones(N), okay)


def runs(mask):
    """Return first row and end of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def test_blocks_are_six_tenths_of_a_second_every_two():
    assert runs(inner_blocks(record(np.ones(N, dtype=bool))))[:3] == [(7, 13), (27, 33), (47, 53)]


def test_each_stretch_has_its_own_and_keeps_its_ends():
    okay = np.ones(N, dtype=bool)
    okay[100:165] = False
    hidden = runs(inner_blocks(record(okay)))
    inside = [(first, end) for first, end in hidden if first >= 165]
    assert inside[0] == (172, 178)
    for first, end in hidden:
        assert okay[first - 7 : end + 7].all()


def test_a_short_stretch_has_none():
    okay = np.zeros(N, dtype=bool)
    okay[:49] = okay[100:] = True
    assert min(first for first, _ in runs(inner_blocks(record(okay)))) == 107


def test_a_sample_that_was_not_measured_does_not_count():
    okay = np.ones(N, dtype=bool)
    okay[30] = False
    assert not inner_blocks(record(okay))[30]
    assert inner_blocks(record(okay))[29]


def test_next_to_a_gap_there_is_none():
    okay = np.ones(N, dtype=bool)
    okay[36] = False
    hidden = runs(inner_blocks(record(okay)))
    assert hidden[:2] == [(7, 13), (47, 53)], "the gap is behind the second, which ends at 33"
