"""What was recognised in the raw recordings: an effect's name, its size, and the readings it touches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimator.diagnosis.acquisition.readings import any_of
from estimator.signals.record import BoolArray, Record

OUTPUT = 0
"""Column of the measured output in ``Finding.cells``; torque input i is column ``1 + i``."""


class Sized(NamedTuple):
    """A parameter as found: value, 95 % interval, unit."""

    value: float
    ci95: tuple[float, float]
    unit: str


@dataclass(frozen=True, slots=True)
class Finding:
    """One effect of the acquisition or of the sensor's resolution.

    Attributes
    ----------
    name : str
        As in the catalogue.
    parameters : mapping of str to Sized
        As in the catalogue.
    cells : mapping of recording's name to ndarray of bool, shape (N, 1 + M)
        The readings it touches: the output, then each torque input.
    p_value : float
        Probability of as much by chance in recordings without the effect.
    statement : str
        One sentence for an engineer.
    """

    name: str
    parameters: Mapping[str, Sized]
    cells: Mapping[str, BoolArray]
    p_value: float
    statement: str

    def touched(self, record: Record) -> BoolArray:
        """Return the readings of a recording that are touched, shape (N, 1 + M); none where it has not been seen."""
        cells = self.cells.get(record.name)
        return no_cells(record) if cells is None else cells

    def rows(self, record: Record) -> BoolArray:
        """Return the rows of a recording with at least one touched reading, shape (N,)."""
        return any_of(self.touched(record))


def no_cells(record: Record) -> BoolArray:
    """Return a mask of a recording's readings that is False throughout, shape (N, 1 + M)."""
    n, inputs = record.torque_nm.shape
    return np.zeros((n, 1 + inputs), dtype=np.bool_)
