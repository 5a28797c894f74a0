"""The sensor reads the magnitude of the speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start, Untestable
from estimator.physics.motion import measured_speed, speed_scale
from estimator.signals.record import OutputKind, Record

STANDSTILL = 0.05
"""Share of its top speed below which a recording comes to standstill between two samples."""

LEAST_SHARE = 0.5
"""Share of the magnitude from which a sensor's own motion has no sign left."""


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return 1: the share is one number."""
    return (1.0,)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is linear in the share."""
    return [(0.9,)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need a recording that comes to standstill: beyond it the sign may change, whatever the sensor reads."""
    if any(float(np.nanmin(np.abs(measured_speed(record)))) < STANDSTILL * speed_scale([record]) for record in records):
        return None
    return Untestable("the speed stays clear of standstill: it has no other sign that could be lost", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the sensor reads the magnitude of the speed (share {values['share']:.2g})"


def implausible(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a sensor that tells the sign of most of the speed: what differs with the sign is something else."""
    if values["share"] >= LEAST_SHARE:
        return ""
    return f"a sensor that reads {values['share']:.2g} of the speed without its sign is not blind for it"


EFFECT = Effect(
    name="speed_sign_blind",
    element=Element.SPEED_SENSOR,
    title="sensor blind for the sign",
    law="y = (1 - s) w_M + s |w_M|",
    source="pick-up with a single track: Fraden, Handbook of Modern Sensors, 5th ed., Springer 2016",
    excited_by="speed that changes sign: reversal",
    parameters=(EffectParameter("share", "", 0.0, 0.0, 1.0, "share of the magnitude: s", most=1.0),),
    structures=EVERY_LINE,
    resembles=("resolver_error",),
    kinds=frozenset({OutputKind.SPEED}),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    implausible=implausible,
    linear=True,
)
