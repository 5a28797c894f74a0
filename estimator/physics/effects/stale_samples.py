"""Stale samples: a reading that was not renewed in time, and repeats the one before without a flag.

It is recognised in the raw recordings (``estimator.diagnosis.acquisition``) and compensated there; no fit releases it.
"""

from __future__ import annotations

from collections.abc import Mapping

from estimator.physics.driveline import Motion
from estimator.physics.effect import EVERY_STRUCTURE, Effect, EffectParameter, Element


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"{100.0 * values['share']:.3g}% of the samples are stale: they repeat the value before without a flag"


EFFECT = Effect(
    name="stale_samples",
    element=Element.ACQUISITION,
    title="stale samples",
    law="x_read[k] = x_read[k-1] in a share of the rows",
    source="asynchronous process data: CiA 301, synchronous and event-driven PDO; sample-and-hold with missed updates",
    excited_by="speed and torque that change from row to row: PRBS",
    parameters=(EffectParameter("share", "", 0.0, 0.0, 1.0, "share of stale rows", most=1.0),),
    structures=EVERY_STRUCTURE,
    resembles=("transport_delay",),
    sentence=sentence,
    recognised=True,
)
