"""Several simulations abreast: eight numbers that one instruction adds, multiplies or compares.

A Jacobian takes some twenty simulations that differ in one parameter each. Compiled for `Lanes` in place of floats, a
law does eight of them at a time. It is written once, for both: where it depends on a number which way to go, it says
so with ``choose``, ``every`` and ``some`` in place of ``if`` (``choice``). And arrays are lent to it, so that no
references are counted in its loops (``lent``).
"""

from estimator.abreast import arithmetic as arithmetic
from estimator.abreast import elementary as elementary
from estimator.abreast.choice import choose, every, like, some
from estimator.abreast.columns import abreast
from estimator.abreast.lent import lent
from estimator.abreast.types import LANES

__all__ = ["LANES", "abreast", "choose", "every", "lent", "like", "some"]
