"""The on-line estimate in words: values with how sure they are, whether it continues, the alarms."""

from __future__ import annotations

import math

from estimator.identification.tracking.alarm import Alarm, TrackingState
from hil.monitor.snapshot import Estimation, Snapshot

WIDEST_BAND = 0.5
"""Share of the value beyond which a band of two standard deviations is cut in a plot, and called UNSURE in words."""

FREQUENCY = "resonance_hz"
"""What an alarm calls a changed resonance; its unit says it where there is little room."""

LIVE = "live"
NOT_EXCITED = "NOT EXCITED"
CONTINUES = (LIVE, NOT_EXCITED)
"""What the title says while samples come in: that they are learnt from, or that they say nothing."""

REPORTED_SHARE = 0.01
"""From this share of missing samples on they are reported: a frame lost now and then is no news."""


def course(snapshot: Snapshot) -> str:
    """Tell in a word or two whether the estimate continues."""
    estimation = snapshot.estimation
    if not estimation.live:
        return "of the last run" if estimation.model else ""
    if snapshot.headline.phase not in ("measure", ""):
        return "not measuring yet"
    if snapshot.quality.stands_still:
        return f"STANDS STILL {snapshot.quality.standing_s:.1f} s"
    return NOT_EXCITED if estimation.state is TrackingState.NOT_EXCITED else LIVE


def condition(snapshot: Snapshot) -> str:
    """Tell how the estimate is: why it stands still, how many samples it had to do without, its own word."""
    estimation, quality = snapshot.estimation, snapshot.quality
    if estimation.live and quality.stands_still:
        return quality.why
    if course(snapshot) in CONTINUES and quality.bad_share >= REPORTED_SHARE:
        return f"{estimation.status}, {100.0 * quality.bad_share:.0f} % masked"
    return estimation.status


def alarm_line(alarm: Alarm) -> str:
    """Tell an alarm in a few words; dots where the estimate is still on its way."""
    change = f"{alarm.before.value:.3g} -> {alarm.after.value:.3g}"
    named = f"{change} Hz" if alarm.quantity == FREQUENCY else f"{alarm.quantity} {change}"
    return named if alarm.settled else f"{named} …"


def no_alarm(estimation: Estimation) -> str:
    """Say that there is no alarm, and what the watch is doing while samples come in."""
    doing = "" if estimation.state is None or not estimation.live else f", {estimation.state.words}"
    return f"alarms    none{doing}"


def nothing_yet(snapshot: Snapshot) -> str:
    """Say why there is no model."""
    hint = ": start an experiment (e)" if snapshot.can_drive and not snapshot.estimation.live else ""
    return f"no on-line model yet{hint}"


def with_interval(value: float, std: float, unit: str, digits: int) -> str:
    """Write a value with two standard deviations, as far as they are known; UNSURE where they say little of it."""
    if not math.isfinite(value):
        return "--"
    if 2.0 * std > WIDEST_BAND * abs(value):
        return f"{value:.{digits}f} ±{2.0 * std:.2g} {unit}".rstrip() + " UNSURE"
    interval = f" ±{2.0 * std:.{digits}f}" if math.isfinite(std) else ""
    return f"{value:.{digits}f}{interval} {unit}".rstrip()


def resonance_in_words(estimation: Estimation) -> str:
    """Write the resonance, with how sure it is."""
    return with_interval(estimation.resonance_hz, estimation.resonance_std_hz, "Hz", 2)
