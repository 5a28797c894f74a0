"""Several simulations in SIMD lanes: eight numbers that one instruction adds, multiplies or compares."""

from estimator.lanes.columns import as_lanes, borrowed
from estimator.lanes.operations import choose, every, like, some
from estimator.lanes.types import LANES

__all__ = ["LANES", "as_lanes", "borrowed", "choose", "every", "like", "some"]
