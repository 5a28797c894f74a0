"""Several simulations in SIMD lanes: eight numbers that one instruction adds, multiplies or compares."""

from estimator.lanes.columns import as_lanes, borrowed
from estimator.lanes.operations import broadcast_as, choose, every, some
from estimator.lanes.types import LANES

__all__ = ["LANES", "as_lanes", "borrowed", "broadcast_as", "choose", "every", "some"]
