"""Which arrays of a file that is a bag of variables are the columns of its recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from hil.recording.kinds import Column


def columns_of_shared_length(vectors: Mapping[str, Column]) -> tuple[dict[str, Column], tuple[str, ...]]:
    """Choose the vectors of the length that most of them share; the longest, where two are equally frequent.

    Returns
    -------
    dict of name to ndarray
        The chosen.
    tuple of str
        One remark for each that was left out.
    """
    counts = Counter(vector.size for vector in vectors.values())
    length = max(counts, key=lambda size: (counts[size], size), default=0)
    chosen = {name: vector for name, vector in vectors.items() if vector.size == length}
    return chosen, tuple(
        f"{name}: left out, it has {vector.size} values and the recording {length}"
        for name, vector in vectors.items()
        if vector.size != length
    )
