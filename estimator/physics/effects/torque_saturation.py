"""The true torque stops at a limit that its reading passes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Start
from estimator.physics.motion import largest_torque, torque_scale
from estimator.signals.record import Record

EDGE = 100.0
"""Sharpness from which on a knee is an edge."""


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return the largest torque of one input, twice, of all together, and 1."""
    each = largest_torque(records)
    return (each, each, torque_scale(records), 1.0)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return limits of both inverters, of one of them, and of their sum."""
    off = Held(math.inf)
    return [
        (*limits, 10.0) for x in (0.9, 0.6) for limits in ((x, x, off), (x, off, off), (off, x, off), (off, off, x))
    ]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    torque = unit("torque", motion)
    found = [
        f"{limit:.3g} {torque} {of}"
        for key, of in (
            ("limit_m1_nm", "in inverter m1"),
            ("limit_m2_nm", "in inverter m2"),
            ("limit_sum_nm", "in sum"),
        )
        if math.isfinite(limit := values[key])
    ]
    return f"the true torque stops at {' and '.join(found)}, whatever its reading"


EFFECT = Effect(
    name="torque_saturation",
    element=Element.TORQUE_PATH,
    title="saturation of the torque",
    law="T = sat(sat(T_M1, L_1) + sat(T_M2, L_2), L), sat(T, L) = T / (1 + |T / L|^n)^(1/n)",
    source="current and voltage limits of an inverter: Leonhard, Control of Electrical Drives, 3rd ed., Springer 2001",
    excited_by="torque near its limits: tip-in, reversal",
    parameters=(
        EffectParameter("limit_m1_nm", "torque", math.inf, 0.05, 1.2, "limit of inverter M1: L_1", True),
        EffectParameter("limit_m2_nm", "torque", math.inf, 0.05, 1.2, "limit of inverter M2: L_2", True),
        EffectParameter("limit_sum_nm", "torque", math.inf, 0.05, 1.2, "limit of the sum: L", True),
        EffectParameter("sharpness", "", EDGE, 2.0, EDGE, "sharpness of the knee: n", True, form="soft"),
    ),
    structures=EVERY_LINE,
    resembles=("inverter_gain_mismatch", "stiffness_nonlinearity"),
    scales=scales,
    starts=starts,
    sentence=sentence,
    linear=True,
)
