"""Speed quantisation: the speed is read in steps that are not small against its noise.

It is recognised in the raw recordings (``estimator.diagnosis.acquisition``) and compensated there; no fit releases it.
"""

from __future__ import annotations

from collections.abc import Mapping

from estimator.physics.driveline import Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element
from estimator.signals.record import OutputKind


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the speed is read in steps of {values['step_rad_s']:.3g} {unit('speed', motion)}"


EFFECT = Effect(
    name="speed_quantisation",
    element=Element.SPEED_SENSOR,
    title="coarse resolution of the speed",
    law="w_read = q round(w / q)",
    source="Widrow, Kollar: Quantization Noise, Cambridge 2008",
    excited_by="a speed that passes many steps",
    parameters=(EffectParameter("step_rad_s", "speed", 0.0, 0.0, float("inf"), "step q"),),
    structures=EVERY_LINE,
    resembles=(),
    sentence=sentence,
    kinds=frozenset({OutputKind.SPEED}),
    recognised=True,
    linear=True,
)
