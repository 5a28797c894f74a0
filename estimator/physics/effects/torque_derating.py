"""The true torque falls behind its reading as magnets and windings warm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start
from estimator.physics.model import DrivelineModel, Motion
from estimator.physics.motion import longest_s
from estimator.signals.record import Record

QUICKEST = 0.04
"""Shortest time constant in lengths of the longest recording: a loss that is complete before anything can have warmed
is a gain, or what a recording began with."""


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return 1 for the depth and the longest recording's length."""
    return (1.0, longest_s(records))


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return a decay within the recording and one that goes on beyond it."""
    return [(0.2, 0.3), (0.3, 2.0)]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return (
        f"the true torque falls by up to {values['depth']:.1%} against its reading, "
        f"with a time constant of {values['time_constant_s']:.3g} s"
    )


def implausible(model: DrivelineModel, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a loss that comes too soon for warmth."""
    least_s = QUICKEST * scales(model, records)[1]
    if values["time_constant_s"] > least_s:
        return ""
    return f"a loss with a time constant of {values['time_constant_s']:.2g} s is not from warming"


EFFECT = Effect(
    name="torque_derating",
    element=Element.TORQUE_PATH,
    title="derating of the torque",
    law="T = T_read (1 - d (1 - exp(-t / tau)))",
    source="magnet flux and temperature: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014",
    excited_by="a long pull at high torque",
    parameters=(
        EffectParameter("depth", "", 0.0, 0.0, 1.0, "share of the torque that is lost in the end: d", most=1.0),
        EffectParameter("time_constant_s", "s", 1.0, 0.02, 10.0, "time constant of the decay: tau"),
    ),
    structures=EVERY_LINE,
    resembles=("inverter_gain_mismatch", "road_grade", "warming_friction"),
    equivalent=(),
    contains=(),
    scales=scales,
    starts=starts,
    sentence=sentence,
    implausible=implausible,
)
