"""Where an estimator keeps its numbers: one vector, cut into named parts.

One vector, because a compiled loop takes one argument faster than ten; named parts, because people and files want
names. Nothing in it grows.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import prod

import numpy as np

from estimator.signals.record import FloatArray, IntArray


class Memory:
    """A vector and its parts.

    Parameters
    ----------
    parts : mapping
        Shape of each part by name, in their order in the vector.
    """

    def __init__(self, parts: Mapping[str, tuple[int, ...]]) -> None:
        sizes = [prod(shape) for shape in parts.values()]
        self.vector: FloatArray = np.zeros(sum(sizes))
        self.at: IntArray = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        self._parts = {
            name: self.vector[start : start + size].reshape(shape)
            for (name, shape), start, size in zip(parts.items(), self.at[:-1], sizes, strict=True)
        }

    def __getitem__(self, name: str) -> FloatArray:
        """Return a part: a view, to be read or written."""
        return self._parts[name]

    def copies(self, without: Iterable[str] = ()) -> dict[str, FloatArray]:
        """Return a copy of every part but those named."""
        left_out = set(without)
        return {name: part.copy() for name, part in self._parts.items() if name not in left_out}
