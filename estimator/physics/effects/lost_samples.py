"""Lost samples: readings that are missing, flagged, or recorded as zero.

It is recognised in the raw recordings (``estimator.diagnosis.acquisition``) and compensated there; no fit releases it.
"""

from __future__ import annotations

from collections.abc import Mapping

from estimator.physics.driveline import Motion
from estimator.physics.effect import EVERY_STRUCTURE, Effect, EffectParameter, Element


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"{100.0 * values['share']:.3g}% of the samples were lost: missing, flagged or recorded as zero"


EFFECT = Effect(
    name="lost_samples",
    element=Element.ACQUISITION,
    title="lost samples",
    law="x_read[k] = NaN, flagged, or 0 in a share of the rows",
    source="missed SYNC or PDO time-out: CiA 301, communication objects",
    excited_by="nothing: it shows in any recording",
    parameters=(EffectParameter("share", "", 0.0, 0.0, 1.0, "share of lost rows", most=1.0),),
    structures=EVERY_STRUCTURE,
    resembles=(),
    sentence=sentence,
    recognised=True,
)
