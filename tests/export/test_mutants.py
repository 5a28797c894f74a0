"""The comparison with the host can fail: each small fault in the text is noticed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimator.identification.identify import Settings
from hil.export.plc_estimator import PlcEstimator
from hil.export.profiles import profile
from hil.export.structured_text import structured_text
from tests.export.drives import bad_drive
from tests.export.mutants import MUTANTS
from tests.export.plc_runs import assert_equal_bits, execute, execute_oefo, on_host, summed

SETTINGS = Settings(adaptation=profile("decreasing_then_constant_trace:trace=1.0"))


@pytest.mark.parametrize(("before", "after"), MUTANTS)
def test_a_fault_in_the_text_is_noticed(before: str, after: str, tmp_path: Path) -> None:
    drive = bad_drive()
    noticed = []
    for L in (np.array([1.0, -0.9, 0.72]), None):
        estimator = PlcEstimator(SETTINGS, L=L)
        text = structured_text(estimator)
        assert before in text
        wrong = text.replace(before, after)
        alone = execute_oefo(wrong, *summed(drive), tmp_path)
        pairs = (
            (execute(wrong, drive, tmp_path), on_host(estimator, drive)),
            (alone, estimator.oefo().run(*summed(drive))),
        )
        for plc, host in pairs:
            try:
                assert_equal_bits(plc, host)
            except AssertionError:
                noticed.append(before)
    assert noticed
