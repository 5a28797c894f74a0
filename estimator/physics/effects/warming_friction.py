"""Viscous friction that decays as the oil warms."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Span, Start
from estimator.physics.motion import longest_s, speed_scale, torque_scale
from estimator.signals.record import Record


@compiled
def cold_part(time_s: float, cold: float, time_constant_s: float) -> float:
    """Return the viscous friction that has not gone away yet [Nm s/rad]."""
    if every(cold == 0.0):
        return 0.0
    return cold * math.exp(-time_s / time_constant_s)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use at the top speed, and the longest recording's length."""
    return (0.05 * torque_scale(records) / speed_scale(records), longest_s(records))


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a decay within the recording and one that continues beyond it."""
    return [(1.0, 0.3), (2.0, 1.5)]


def described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the friction from warm to cold."""
    name = "b_L" if "b_L" in line else "b_M"
    return {name: ((line[name], line[name] + values["cold_nm_s"]),)}


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return (
        f"viscous friction falls by {values['cold_nm_s']:.3g} {unit('damping', motion)} as the oil warms, "
        f"with a time constant of {values['time_constant_s']:.3g} s"
    )


EFFECT = Effect(
    name="warming_friction",
    element=Element.LOAD,
    title="friction of warming oil",
    law="b_L becomes b_L + b_cold exp(-t / tau)",
    source="viscosity of oil over temperature (Walther's equation): ASTM D341",
    excited_by="steady driving from cold",
    parameters=(
        EffectParameter("cold_nm_s", "damping", 0.0, 0.0, 60.0, "friction that goes away: b_cold"),
        EffectParameter("time_constant_s", "s", 1.0, 0.02, 10.0, "time constant of warming: tau"),
    ),
    structures=EVERY_LINE,
    resembles=("torque_derating", "road_grade"),
    scales=scales,
    starts=starts,
    sentence=sentence,
    described=described,
    waving=True,
    timed=True,
)
