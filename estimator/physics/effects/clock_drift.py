"""Torque and speed are stamped by clocks that run at different rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Start
from estimator.physics.motion import longest_s
from estimator.signals.record import Record

PARTED_S = 0.03
"""How far apart the clocks of the scale are at the end [s]: half a period of a resonance at 16 Hz. A fit that begins
further off ends where another of its periods matches."""


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return the rate of clocks that part by ``PARTED_S`` over the longest recording."""
    return (PARTED_S / longest_s(records),)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return starts on both sides, none further than a scale from the next: the error is not convex in the rate."""
    return [(side * parted,) for parted in (0.3, 1.0, 2.0, 3.0) for side in (-1.0, 1.0)]


def unresolved(model: Driveline, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to clocks that part by less than a tenth of a sampling period over the longest recording."""
    least_s = 0.1 * min(record.sample_time_s for record in records)
    parted_s = abs(values["rate"]) * longest_s(records)
    if parted_s >= least_s:
        return ""
    return f"the clocks part by {1e3 * parted_s:.2g} ms, less than a tenth of the sampling period"


def rescaled(values: Mapping[str, float]) -> Mapping[str, float]:
    """Return what the line takes by the torque's clock: the fit keeps to the speed's, and either may be right.

    Torques and speeds stay as they were read. In a time that is longer, accelerations are smaller and twists larger.
    """
    longer = 1.0 + values["rate"]
    return {"inertia": longer, "stiffness": 1.0 / longer}


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the torque's clock runs {1e6 * values['rate']:+.0f} ppm off the speed's"


EFFECT = Effect(
    name="clock_drift",
    element=Element.ACQUISITION,
    title="drift of the clocks",
    law="T(t) = T_read((1 + r) t)",
    source="free-running node clocks: CiA 301 (SYNC, TIME); Mills, Computer Network Time Synchronization, 2011",
    excited_by="long recordings with torque steps",
    parameters=(EffectParameter("rate", "", 0.0, -20.0, 20.0, "relative difference of the rates: r"),),
    structures=EVERY_LINE,
    resembles=("transport_delay", "sample_jitter"),
    scales=scales,
    starts=starts,
    unresolved=unresolved,
    sentence=sentence,
    rescaled=rescaled,
    linear=True,
    timed=True,
)
