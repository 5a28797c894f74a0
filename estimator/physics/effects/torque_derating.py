"""The true torque falls behind its reading as magnets and windings warm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Retelling, Start
from estimator.physics.motion import longest_s, torque_scale
from estimator.signals.record import Record

QUICKEST = 0.04
"""Shortest time constant in lengths of the longest recording: a loss that is complete before anything can have warmed
is a gain, or what a recording began with."""


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return 1 for the depth, the longest recording's length, and half of the torque in use, a usual rms of it."""
    return (1.0, longest_s(records), 0.5 * torque_scale(records))


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return a decay within the recording and one that continues beyond it, by time alone."""
    return [(0.2, 0.3, Held(0.0)), (0.3, 2.0, Held(0.0))]


def retold(
    model: Driveline, records: Sequence[Record], values: Mapping[str, float], line: Mapping[str, float]
) -> list[Retelling]:
    """Return a loss by the torque's own heat, within the recording and beyond it.

    The torque that the loss is reported for is a matter of scale, and held.
    """
    if values["heating_nm"] > 0.0:
        return []
    return [Retelling((values["depth"], share, Held(1.0)), {}) for share in (0.3, 2.0)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    by = "by up to"
    if values["heating_nm"] > 0.0:
        by = f"under a lasting torque of {values['heating_nm']:.3g} {unit('torque', motion)} by"
    return (
        f"the true torque falls {by} {values['depth']:.1%} against its reading, "
        f"with a time constant of {values['time_constant_s']:.3g} s"
    )


def implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a loss that comes too soon for warmth."""
    least_s = QUICKEST * scales(model, records)[1]
    if values["time_constant_s"] > least_s:
        return ""
    return f"a loss with a time constant of {values['time_constant_s']:.2g} s is not from warming"


EFFECT = Effect(
    name="torque_derating",
    element=Element.TORQUE_PATH,
    title="derating of the torque",
    law="T = T_read (1 - d h), h = 1 - exp(-t / tau); by its own heat tau dh/dt + h = (T_read / T_n)^2",
    source="magnet flux and temperature: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014; "
    "heat of a winding: IEC 60255-149",
    excited_by="a long pull at high torque",
    parameters=(
        EffectParameter("depth", "", 0.0, 0.0, 1.0, "share of the torque that is lost in the end: d", most=1.0),
        EffectParameter("time_constant_s", "s", 1.0, 0.02, 10.0, "time constant of the decay: tau"),
        EffectParameter("heating_nm", "torque", 0.0, 0.0, 10.0, "torque that leads to the loss d: T_n", True),
    ),
    structures=EVERY_LINE,
    resembles=("inverter_gain_mismatch", "road_grade", "warming_friction"),
    scales=scales,
    starts=starts,
    retold=retold,
    sentence=sentence,
    implausible=implausible,
    linear=True,
)
