"""No verdict of a test depends on what else the machine does: a fixture for a ``conftest.py``."""

import math
from collections.abc import Iterator
from importlib import import_module

import pytest


@pytest.fixture(autouse=True, scope="session")
def all_the_time_it_needs() -> Iterator[None]:
    """Let a diagnosis that is given no budget have no end of it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(import_module("estimator.diagnosis.diagnose"), "BUDGET_S", math.inf)
        yield
