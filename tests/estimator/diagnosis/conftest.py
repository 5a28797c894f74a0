from __future__ import annotations

import math
from collections.abc import Iterator
from importlib import import_module

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(autouse=True, scope="session")
def one_blas_thread() -> Iterator[None]:
    """As ``diagnose`` has it: on tall, thin matrices more threads only wait for each other."""
    with threadpool_limits(1, user_api="blas"):
        yield


@pytest.fixture(autouse=True)
def all_the_time_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    """No verdict of a test depends on what else the machine does."""
    monkeypatch.setattr(import_module("estimator.diagnosis.diagnose"), "BUDGET_S", math.inf)
