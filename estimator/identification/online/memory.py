"""Where an estimator keeps its numbers: one record, cut into named parts of fixed shapes.

A record, because its type *is* its layout: a loop compiled for it knows every shape and every place, unrolls what is
eight long, keeps what it can in registers, and looks up no bound. It is compiled once for each structure (na, nb, nk,
length of L) and kept on disk. Compiled code reads a part as an attribute, ``m.theta[i]``; no reference to it is
counted there, since a record owns nothing. People and files have the same names. Nothing in it grows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimator.signals.record import FloatArray

Parts = Any
"""The record inside a compiled loop: numba's own type, which has no name in Python. Its parts are its attributes."""

Shapes = Mapping[str, tuple[int, ...]]


class Memory:
    """A record of numbers and its parts.

    Parameters
    ----------
    kept : mapping
        Shape of each part that the next sample needs, by name.
    settings : mapping
        Numbers that no sample changes, by name: what is kept is worth nothing without them.
    room : mapping, optional
        Shape of each part that no sample leaves anything in for the next.
    """

    def __init__(self, kept: Shapes, settings: Mapping[str, FloatArray], room: Shapes | None = None) -> None:
        shapes = {**kept, **{name: numbers.shape for name, numbers in settings.items()}, **(room or {})}
        self.record = np.zeros(1, dtype=[(name, np.float64, shape) for name, shape in shapes.items()])
        self._kept, self._settings = tuple(kept), tuple(settings)
        for name, numbers in settings.items():
            self[name][...] = numbers

    def __getitem__(self, name: str) -> FloatArray:
        """Return a part: a view, to be read or written."""
        part: FloatArray = self.record[name][0]
        return part

    @property
    def settings(self) -> dict[str, FloatArray]:
        """Copies of the settings, by name."""
        return {name: self[name].copy() for name in self._settings}

    @property
    def kept(self) -> dict[str, FloatArray]:
        """Copies of what the next sample needs, by name."""
        return {name: self[name].copy() for name in self._kept}
