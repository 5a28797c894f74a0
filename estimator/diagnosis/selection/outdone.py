"""What a law without a name outdoes before it is fitted: more effects would say with more what one law says.

Such a law is an objection to them, however little they leave (``judgement``): their fits are spared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from estimator.diagnosis.evidence import VERY_STRONG, price
from estimator.diagnosis.hypotheses import NOTHING, Effects
from estimator.diagnosis.unnamed import UnnamedLaw
from estimator.diagnosis.weight import BELIEVED_TOGETHER, reads_speed
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult


def outdone(law: UnnamedLaw | None, retuned: FitResult, noise: float, chosen: Effects, names: Sequence[str]) -> Effects:
    """Return effects that could not be believed beside those chosen, whatever the fit of them all would leave.

    Parameters
    ----------
    law : UnnamedLaw or None
        The best law without a name for what the re-tuned nominal leaves.
    noise : float
        Which no explanation goes below [unit of the output].
    names : sequence of str
        All effects that are tried.
    """
    if law is None or law.rms > noise or not reads_speed(retuned):
        return NOTHING
    count = len(chosen) + 1
    margin = VERY_STRONG / math.log(law.gain.n_effective)
    if least_price(count, len(names), law.gain.n_effective) <= price(law.gain, retuned.rms, law.rms) + margin:
        return NOTHING
    if count > BELIEVED_TOGETHER:
        return frozenset(names) - chosen
    if any(law.element in places(name) for name in chosen):
        return NOTHING
    return frozenset(name for name in names if law.element not in places(name)) - chosen


def least_price(effects: int, hypotheses: int, n: float) -> float:
    """Return how many unknowns so many effects cost at least, each chosen among many, by ``n`` independent samples."""
    return effects * (1.0 + 2.0 * math.log(hypotheses) / math.log(n))


def places(name: str) -> frozenset[Element]:
    """Return where an effect acts, and whatever the recordings may be unable to tell from it."""
    entry = EFFECTS[name]
    kin = {name, *entry.resembles, *entry.equivalent}
    kin |= {other for other in EFFECTS if name in (*EFFECTS[other].resembles, *EFFECTS[other].equivalent)}
    return frozenset(EFFECTS[each].element for each in kin)
