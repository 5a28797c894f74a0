"""What off-line models are fitted to."""

import numpy as np
import pytest

from estimator.signals.decimate import MOST, block_of, first_part
from estimator.signals.record import Record


@pytest.mark.parametrize("sample_time_s", [0.001, 0.01, 0.02])
def test_of_a_long_recording_the_first_part_is_taken(sample_time_s: float) -> None:
    most = MOST * block_of(sample_time_s)
    n = most + 1000
    time_s = sample_time_s * np.arange(n)
    record = Record("long", sample_time_s, time_s, np.ones((n, 1)), time_s, np.ones(n, dtype=bool))
    part = first_part(record)
    assert part.time_s.shape == part.output.shape == part.okay.shape == (most,)
    assert np.array_equal(part.output, record.output[:most])
    assert first_part(part) is part
