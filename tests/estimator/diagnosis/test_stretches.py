"""Long recordings are looked at in stretches, spread evenly and reported."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from estimator.diagnosis.noise import LONGEST_S, MOST_SAMPLES, share_of, stretches
from estimator.diagnosis.segments import cut
from estimator.signals.record import Record
from tests.estimator.physics.bench import record


def lasting(samples: int, name: str = "run") -> Record:
    return record(np.zeros(samples), np.zeros(samples), name=name)


def test_of_what_is_longer_stretches_from_beginning_to_end_are_used() -> None:
    rec = lasting(10 * MOST_SAMPLES)
    parts = stretches(rec, [slice(0, rec.output.size)], share_of([rec]))
    assert sum(part.stop - part.start for part in parts) == pytest.approx(MOST_SAMPLES, rel=0.01)
    assert max(part.stop - part.start for part in parts) <= LONGEST_S / rec.sample_time_s
    assert (parts[0].start, parts[-1].stop) == (0, rec.output.size)
    gaps = [after.start - before.stop for before, after in pairwise(parts)]
    assert min(gaps) > 0
    assert max(gaps) - min(gaps) <= 1


def test_recordings_share_what_may_be_used_by_their_length() -> None:
    found = cut([lasting(3 * MOST_SAMPLES, "long"), lasting(MOST_SAMPLES, "short")])
    used = {name: sum(r.output.size for r in found.records if r.name.startswith(name)) for name in ("long", "short")}
    assert used["long"] == pytest.approx(3 * used["short"], rel=0.01)


def test_many_short_recordings_stay_whole() -> None:
    samples = round(0.5 * LONGEST_S / 0.01)
    records = [lasting(samples, f"run_{i}") for i in range(2 * MOST_SAMPLES // samples)]
    found = cut(records)
    assert [each.output.size for each in found.records] == [samples] * len(records)
    assert found.warnings == ()
