"""Dry friction that is higher near standstill: breakaway torque falling to the Coulomb level with speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.lanes import choose, every
from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Retelling, Start, Untestable
from estimator.physics.effects import coulomb_friction_motor
from estimator.physics.effects.coulomb_friction_motor import CREEP, PRESLIDING
from estimator.physics.laws import fading, smooth_sign
from estimator.physics.motion import speed_scale
from estimator.signals.record import Record


@compiled
def law(speed: float, excess: float, coulomb: float, stribeck_speed: float, width: float) -> float:
    """Return ``(T_c + T_x exp(-(w/w_s)^2)) sign(w)``, the friction torque against the motion."""
    if every(stribeck_speed <= 0.0):
        return 0.0
    ratio = speed / stribeck_speed
    torque = (coulomb + excess * fading(ratio * ratio)) * smooth_sign(speed, width)
    return choose(stribeck_speed > 0.0, torque, 0.0)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, twice, a twentieth of the top speed, a usual presliding, and creep."""
    torque, presliding, creep = coulomb_friction_motor.scales(model, records)
    return (torque, torque, 0.05 * speed_scale(records), presliding, creep)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return starts at narrow and wide Stribeck ranges: the fit is not convex in the width."""
    return [(0.5, 0.3, width, Held(0.0), Held(0.0)) for width in (0.6, 1.5, 3.0)]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return the friction that was found, bending before it slides, or creeping near rest."""
    if values["presliding_rad"] > 0.0 or values["creep_rad_s"] > 0.0:
        return []
    found = (values[name] for name in ("excess_nm", "coulomb_nm", "stribeck_rad_s"))
    start = tuple(value / scale for value, scale in zip(found, scales(model, records)[:3], strict=True))
    return [Retelling((*start, 1.0, Held(0.0)), {}), Retelling((*start, Held(0.0), 1.0), {})]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need what Coulomb friction needs: both signs of the speed."""
    return coulomb_friction_motor.testable(model, records)


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    torque, speed = unit("torque", motion), unit("speed", motion)
    breakaway = values["coulomb_nm"] + values["excess_nm"]
    return (
        f"dry friction at the motor with a Stribeck effect: {breakaway:.3g} {torque} at breakaway, falling to "
        f"{values['coulomb_nm']:.3g} {torque} above about {values['stribeck_rad_s']:.3g} {speed}"
    )


EFFECT = Effect(
    name="stribeck_friction",
    element=Element.MOTOR,
    title="Stribeck friction at the motor",
    law="T_f = g(w_M) sign(w_M), g = T_c + T_x exp(-(w_M/w_s)^2); with presliding "
    "dT_f/dt = ((T_c + T_x) / x_b) (w_M - |w_M| T_f / g); creeping T_f = g(w_M) tanh(w_M / w_c)",
    source="Armstrong-Hélouvry, Dupont, Canudas de Wit: Automatica 30(7), 1994; presliding: Canudas de Wit and others, "
    "IEEE Trans. Automat. Contr. 40(3), 1995",
    excited_by="slow motion in both directions, several passes through standstill",
    parameters=(
        EffectParameter("excess_nm", "torque", 0.0, 0.0, 40.0, "breakaway torque above T_c: T_x"),
        EffectParameter("coulomb_nm", "torque", 0.0, 0.0, 40.0, "friction torque at speed: T_c"),
        EffectParameter("stribeck_rad_s", "speed", 0.0, 0.02, 20.0, "speed range of the fall: w_s"),
        PRESLIDING,
        CREEP,
    ),
    structures=EVERY_LINE,
    resembles=("coulomb_friction_motor", "backlash", "coulomb_friction_load"),
    contains=("coulomb_friction_motor",),
    scales=scales,
    starts=starts,
    testable=testable,
    retold=retold,
    sentence=sentence,
    linear=True,
)
