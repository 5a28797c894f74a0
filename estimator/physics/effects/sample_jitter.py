"""Sample jitter: readings taken off their time by a random amount.

It is recognised in the raw recordings (``estimator.diagnosis.acquisition``) and compensated there; no fit releases it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import EVERY_STRUCTURE, Effect, EffectParameter, Element
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return one sampling period."""
    return (min(record.sample_time_s for record in records),)


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the sampling instants jitter by {1e3 * values['jitter_s']:.3g} ms (rms)"


EFFECT = Effect(
    name="sample_jitter",
    element=Element.ACQUISITION,
    title="jitter of the sampling instants",
    law="y_read[k] = y(t_k + tau_k), tau_k independent, rms sigma_t",
    source="Balakrishnan: On the problem of time jitter in sampling, IRE Trans. Inf. Theory 8(3), 1962",
    excited_by="a speed that changes fast: PRBS near the resonance",
    parameters=(EffectParameter("jitter_s", "s", 0.0, 0.0, 1.0, "rms of the time off"),),
    structures=EVERY_STRUCTURE,
    resembles=("clock_drift",),
    scales=scales,
    sentence=sentence,
    recognised=True,
)
