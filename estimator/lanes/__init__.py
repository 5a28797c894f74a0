"""Several simulations in SIMD lanes: eight numbers that one instruction adds, multiplies or compares.

A Jacobian takes some twenty simulations that differ in one parameter each. Compiled for `Lanes` in place of floats, a
law does eight of them at a time. It is written once, for both: where it depends on a number which way to go, it says
so with ``choose``, ``every`` and ``some`` in place of ``if`` (``operations``). It borrows its arrays, so that no
references are counted in its loops (``columns``).
"""

from estimator.lanes.columns import as_lanes, borrowed
from estimator.lanes.operations import choose, every, like, some
from estimator.lanes.types import LANES

__all__ = ["LANES", "as_lanes", "borrowed", "choose", "every", "like", "some"]
