"""The true torque grows less than its reading: the machine's iron saturates, for both signs alike or not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import (
    EVERY_LINE,
    Acting,
    Effect,
    EffectParameter,
    Element,
    Held,
    Place,
    Start,
    Untestable,
)
from estimator.physics.motion import torque_reverses, torque_scale
from estimator.signals.record import FloatArray, Record

SPREAD = 0.3
"""Share of the largest torque by which its size must differ: about one size any law is a gain."""


def law(torque: FloatArray, _since_start_s: FloatArray, curvature: float, asymmetry: float) -> FloatArray:
    """Return ``T - q T |T| - e T^2``, the torque that acts [Nm]."""
    return np.asarray(torque - torque * (curvature * np.abs(torque) + asymmetry * torque))


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a tenth of the torque lost at the largest in use."""
    each = 0.1 / torque_scale(records)
    return (each, each)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a symmetric law, and one of the positive torque alone."""
    return [(0.5, Held(0.0)), (0.3, 0.3)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need torques of very different sizes."""
    sizes = np.concatenate([np.abs(record.total_torque_nm) for record in records])
    low, high = np.percentile(sizes, [10, 95])
    if high - low > SPREAD * high and any(torque_reverses(record) for record in records):
        return None
    return Untestable("the torque is always of about one size: not separable from a gain", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    loss, tilt = values["curvature_per_nm"], values["asymmetry_per_nm"]
    torque = unit("torque", motion)
    if tilt == 0.0:
        return f"the true torque differs from its reading by {-100.0 * loss:+.2%} at 100 {torque}"
    return (
        f"the true torque differs from its reading by {-100.0 * (loss + tilt):+.2%} at 100 {torque} and by "
        f"{-100.0 * (loss - tilt):+.2%} at -100 {torque}"
    )


EFFECT = Effect(
    name="torque_nonlinearity",
    element=Element.TORQUE_PATH,
    title="nonlinear torque",
    law="T = T_read - q T_read |T_read| - e T_read^2",
    source="saturation of the iron: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014, ch. 3",
    excited_by="small and large torques of both signs",
    parameters=(
        EffectParameter("curvature_per_nm", "per_torque", 0.0, -6.0, 6.0, "loss per torque, both signs: q"),
        EffectParameter("asymmetry_per_nm", "per_torque", 0.0, -6.0, 6.0, "more for positive torque: e", True),
    ),
    example={"curvature_per_nm": 8e-4, "asymmetry_per_nm": 3e-4},
    acting=Acting(Place.TORQUE, law),
    structures=EVERY_LINE,
    resembles=("torque_saturation", "inverter_gain_mismatch", "stiffness_nonlinearity"),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    linear=True,
)
