"""Whether the torque excites the resonance, and what follows for the estimate: judged at the end of every block.

What the torque makes of the output at the resonance (its density at the peak, simulated with the last resonance that
was known) is held against the density S of the residual there (:mod:`follow`).

**Excited** is a block in which it is the larger. To become so, and to stay so with a torque that has become much
weaker, it takes :data:`OPENS` times as much: a torque that is nothing but the noise of its reading makes an output that
is not there, the residual then holds it as well, and on average the two are equal at most. A single look at a narrow
band of noise has the exponential distribution, and exceeds ln(1000) times its mean once in 1000; a block of one second
is about one look at a damping of 0.06 and 8 Hz.

**Not excited** has two reasons. If the torque's steps have less than 1 / :data:`OPENS` of the power they had while
excited, the excitation is *lacking*: the PRBS is off. The estimator is then held, for it would learn noise, and forget.
Otherwise it is *drowned*, which two blocks in a row have to say, since such a look may also be that much too low: the
noise is above what the model makes of the torque, although the torque is as it was, or there never was any excitation.
What has been learnt is then worth nothing, and is begun anew; where that has the same end, there is no excitation. So
an estimate that was held at wrong values is freed, too.

**How sure.** An estimate that is held is not corrected, so that its covariance stays. But the samples of the last
:data:`follow.MEMORY` say less and less of the resonance: their information goes with the power of the torque's steps in
them. By what is left of it, against while excited, the variances are divided.
"""

from __future__ import annotations

import math
from enum import IntEnum

OPENS = math.log(1000.0)
"""Density of the torque's output over that of the residual from which on it is excitation, see above."""

CLOSES = 1.0
"""The same, below which it is none any more: the torque moves the output less than everything else does."""


class Excitation(IntEnum):
    """Verdict on a block; the numbers are those of the compiled loop."""

    UNKNOWN = 0  # no resonance has been known yet
    EXCITED = 1
    LACKING = 2  # the torque has lost its power
    DROWNED = 3  # the noise is above what the model makes of the torque
