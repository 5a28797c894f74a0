"""Which arrays of a file that is a bag of variables are the columns of its recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from hil.recording.kinds import Column


def columns_of_shared_length(
    vectors: Mapping[str, Column], wanted: Iterable[str] = ()
) -> tuple[dict[str, Column], tuple[str, ...]]:
    """Choose the vectors of the length that most of those wanted share, or most of all.

    The longest, where two lengths are equally frequent.
    """
    asked = [vectors[name] for name in wanted if name in vectors]
    counts = Counter(vector.size for vector in asked or vectors.values())
    length = max(counts, key=lambda size: (counts[size], size), default=0)
    chosen = {name: vector for name, vector in vectors.items() if vector.size == length}
    return chosen, tuple(
        f"{name}: left out, it has {vector.size} values and the recording {length}"
        for name, vector in vectors.items()
        if vector.size != length
    )
