"""What of a recorded torque reaches the shaft in a sub-step, behind a delay and a lag: whatever the line does there."""

from __future__ import annotations

from typing import NamedTuple

from estimator.compiled import inlined
from estimator.physics.effects import actuator_lag, transport_delay
from estimator.physics.kernel import slots
from estimator.physics.low_pass import LowPass, low_pass
from estimator.signals.record import FloatArray


class Feed(NamedTuple):
    """What is known of a torque's way before it begins.

    Attributes
    ----------
    shifted : bool
        Whether it is delayed, or its clock another.
    delay, begun : float
        The delay, and the time at sample 0 [samples].
    before_all : float
        The torque before the first sample [Nm].
    lag : LowPass
        What it lags behind.
    """

    shifted: bool
    delay: float
    begun: float
    before_all: float
    lag: LowPass


@inlined
def is_late(p: FloatArray) -> bool:
    """Tell whether a torque reaches the shaft otherwise than it was read."""
    return bool(p[slots.DELAY] != 0.0 or p[slots.DRIFT] != 0.0 or p[slots.LAG] > 0.0)


@inlined
def begun_feed(torque: FloatArray, begun: float, sample_time_s: float, p: FloatArray, h: float) -> Feed:
    """Return what is known of the way of a torque, shape (N,), to sub-steps of ``h`` [s].

    Its sample 0 is at ``begun`` [samples].
    """
    shifted, before_all = p[slots.DELAY] != 0.0 or p[slots.DRIFT] != 0.0, torque[0] + p[slots.DELAYED_BEFORE]
    lag = low_pass(p[slots.LAG], p[slots.LAG_SHAPE], h)
    return Feed(shifted, p[slots.DELAY] / sample_time_s, begun, before_all, lag)


@inlined
def fed(
    torque: FloatArray,
    feed: Feed,
    k: int,
    part: float,
    length: float,
    lagged: float,
    lag_rise: float,
    p: FloatArray,
) -> tuple[float, float, float, float]:
    """Return mean and rise of the torque on the shaft [Nm] over a sub-step, and the lag's state at its end.

    The sub-step begins a ``part`` of a sample behind sample k and is ``length`` samples long.
    """
    place = k + part
    supplied, rise = torque[k], 0.0
    if feed.shifted:
        source = place + (place + feed.begun) * p[slots.DRIFT] - feed.delay
        supplied, rise = transport_delay.delayed(torque, feed.before_all, source, length)
    return actuator_lag.step(supplied, rise, lagged, lag_rise, feed.lag)
