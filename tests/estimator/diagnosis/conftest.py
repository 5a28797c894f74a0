from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits

from tests.without_budget import all_the_time_it_needs

__all__ = ["all_the_time_it_needs"]


@pytest.fixture(autouse=True, scope="session")
def one_blas_thread() -> Iterator[None]:
    """As ``diagnose`` has it: on tall, thin matrices more threads only wait for each other."""
    with threadpool_limits(1, user_api="blas"):
        yield
