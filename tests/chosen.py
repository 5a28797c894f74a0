"""Of many cases of one kind: some at every change, all by ``make campaign``."""

from collections.abc import Iterable

import pytest
from _pytest.mark import ParameterSet


def one_in(n: int, cases: Iterable[object]) -> list[ParameterSet]:
    """Every ``n``-th case, beginning with the first, and the others marked as of the campaign."""
    return [_given(case) if number % n == 0 else campaign(case) for number, case in enumerate(cases)]


def campaign(case: object) -> ParameterSet:
    """One set of arguments that only ``make campaign`` runs; several of them as a tuple."""
    return _given(case, pytest.mark.campaign)


def _given(case: object, *marks: pytest.MarkDecorator) -> ParameterSet:
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=marks)
