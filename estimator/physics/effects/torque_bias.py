"""The reading of the torque is off by an offset, from the start on or as it drifts away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.driveline import Driveline, Load, Motion, unit
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
from estimator.physics.motion import longest_s, torque_scale
from estimator.signals.record import FloatArray, Record

LEAST_S = 8.0
"""A drift shows in recordings of this length: in less it is the noise of the reading."""


def law(torque: FloatArray, since_start_s: FloatArray, offset: float, time_constant_s: float) -> FloatArray:
    """Return ``T + b (1 - exp(-t / tau))``, the torque that acts [Nm]; ``T + b`` without a time constant."""
    if time_constant_s <= 0.0:
        return np.asarray(torque + offset)
    return np.asarray(torque - offset * np.expm1(-since_start_s / time_constant_s))


def is_load_known(model: Driveline) -> bool:
    """Tell whether the constant load torque is a number that the model gives."""
    return not isinstance(model.load, Load)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a fiftieth of the torque in use, and the longest recording's length."""
    return (0.02 * torque_scale(records), longest_s(records))


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return drifts that end within the recording and beyond it, and an offset where the load is known."""
    drifting: list[Start] = [(0.5, 0.3), (1.0, 2.0)]
    return [(0.5, Held(0.0)), *drifting] if is_load_known(model) else drifting


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need the load torque, or time to drift."""
    if is_load_known(model) or longest_s(records) >= LEAST_S:
        return None
    reason = f"every recording is shorter than {LEAST_S:g} s and the constant load torque is unknown"
    return Untestable(reason, "cruise", needs="constant in the model file's [load], for an offset that does not drift")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    side = "above" if values["offset_nm"] > 0.0 else "below"
    offset = f"{abs(values['offset_nm']):.3g} {unit('torque', motion)} {side} its reading"
    if values["time_constant_s"] <= 0.0:
        return f"the true torque is {offset}"
    return f"the true torque drifts to {offset}, with a time constant of {values['time_constant_s']:.3g} s"


EFFECT = Effect(
    name="torque_bias",
    element=Element.TORQUE_PATH,
    title="offset of the torque reading",
    law="T = T_read + b; drifting T = T_read + b (1 - exp(-t / tau))",
    source="offset of current sensors and its drift: IEC 60688; Leonhard, Control of Electrical Drives, 3rd ed., 2001",
    excited_by="long recordings, the same course of the load in several",
    parameters=(
        EffectParameter("offset_nm", "torque", 0.0, -20.0, 20.0, "offset: b"),
        EffectParameter("time_constant_s", "s", 0.0, 0.02, 10.0, "time constant of its drift: tau", True),
    ),
    example={"offset_nm": 25.0, "time_constant_s": 4.0},
    acting=Acting(Place.TORQUE, law),
    structures=EVERY_LINE,
    resembles=("road_grade", "warming_friction", "torque_derating"),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    linear=True,
)
