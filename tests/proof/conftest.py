"""Recordings that are short, for tests of what is done with a recording and not of what is in it."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from hil.proof.truth import bus
from tests.without_budget import all_the_time_it_needs

__all__ = ["all_the_time_it_needs"]


@contextmanager
def recordings_of(samples: int) -> Iterator[None]:
    """Let what is recorded meanwhile have so many samples, of 10 ms each, instead of 3000."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bus, "SAMPLES", samples)
        yield


@pytest.fixture
def brief() -> Iterator[None]:
    """Three seconds: a case is made in a tenth of the time."""
    with recordings_of(300):
        yield
