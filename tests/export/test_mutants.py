"""The comparison with the host can fail: each small fault in the text is noticed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from estimator.identification.online.recursive import Trajectory
from estimator.identification.settings import Settings
from hil.export.plc_estimator import PlcEstimator
from hil.export.profiles import profile
from tests.export.drives import bad_drive
from tests.export.mutants import MUTANTS
from tests.export.plc_runs import Kept, assert_equal_bits, execute, execute_oefo, exported, on_host, summed

SETTINGS = Settings(adaptation=profile("decreasing_then_constant_trace:trace=1.0"))


@pytest.mark.parametrize(("before", "after"), MUTANTS)
def test_a_fault_in_the_text_is_noticed(before: str, after: str, tmp_path: Path) -> None:
    assert any(not same_bits(plc, host) for plc, host in both_sides(before, after, tmp_path))


def both_sides(before: str, after: str, folder: Path) -> Iterator[tuple[Kept, Trajectory]]:
    """Yield what the text with a fault and the host make of a drive, until the fault has been noticed."""
    drive = bad_drive()
    for L in (np.array([1.0, -0.9, 0.72]), None):
        estimator = PlcEstimator(SETTINGS, L=L)
        text = exported(estimator)
        assert before in text
        wrong = text.replace(before, after)
        yield execute(wrong, drive, folder), on_host(estimator, drive)
        yield execute_oefo(wrong, *summed(drive), folder), estimator.oefo().run(*summed(drive))


def same_bits(plc: Kept, host: Trajectory) -> bool:
    try:
        assert_equal_bits(plc, host)
    except AssertionError:
        return False
    return True
