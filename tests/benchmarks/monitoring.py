"""Alarms while driving, in every state of excitation: ``python -m tests.benchmarks.monitoring``.

In two worlds that share nothing: **road**, two-mass buses on the road of ``hil paper`` with a driver, and **dirty**,
the proof's truth with dry friction, drag, hills, a lagging inverter and a resolver error. Every drive is another bus.

1. **Drift**: the stiffness drifts for minutes, by 0.5 to 3 % every 10 s. How many drives are alarmed again after their
   first alarm, how many alarms there are, and what the resonance moved by at most without one.
2. **No change**: hours of driving under a PRBS that is strong, weak, off, or changes every minute. How much of it was
   watched, how much was not excited, and the alarms: at a stated rate high enough to be counted, with no change
   tolerated, so that the statistics decide and nothing else; and with the settings as shipped.
3. **Change while the PRBS is off**: found when it is on again?
"""

import argparse
import sys
from collections.abc import Callable, Iterator

import numpy as np

from estimator.identification.chain import OnlineChain, OnlineTrajectory
from estimator.identification.tracking.alarm import TrackingState
from estimator.identification.tracking.watch import WatchSettings
from estimator.signals.record import Record
from hil.rig.live import tracking_settings
from tests.estimator.identification.tracking import dirty_buses, roads
from tests.estimator.identification.tracking.roads import PERIOD_S, Course

World = Callable[[int, float, Course, Course], Record]
WORLDS: dict[str, World] = {
    "road": lambda seed, duration_s, prbs_nm, stiffness: roads.drive(seed, duration_s, prbs_nm, stiffness).record,
    "dirty": dirty_buses.drive,
}

STRONG_NM, WEAK_NM = 120.0, 30.0
SCHEDULES: dict[str, Course] = {
    "strong": lambda time_s: STRONG_NM,
    "weak": lambda time_s: WEAK_NM,
    "strong and weak": lambda time_s: STRONG_NM if time_s % 120.0 < 60.0 else WEAK_NM,
    "on and off": lambda time_s: STRONG_NM if time_s % 120.0 < 60.0 else 0.0,
    "off": lambda time_s: 0.0,
}

DRIFTS = {0.005: 360.0, 0.01: 240.0, 0.03: 120.0, -0.005: 360.0, -0.01: 240.0, -0.03: 120.0}
"""Share of the stiffness in 10 s, and how long it drifts [s]."""

DRIFT_S = 60.0
"""When it begins."""

DRIVE_S = 1200.0
"""Length of a drive without change."""

COUNTED = WatchSettings(20.0, smallest_change=0.0)
SHIPPED = WatchSettings()


def play(record: Record, watch: WatchSettings = SHIPPED) -> OnlineTrajectory:
    """Follow one drive as `hil run` does."""
    return OnlineChain(tracking_settings(), PERIOD_S, watch=watch).run(record)


def found_s(course: OnlineTrajectory) -> list[float]:
    """Return when changes were found [s]."""
    return [alarm.time_s for alarm in course.alarms if not alarm.settled]


def constant(time_s: float) -> float:
    """Keep the stiffness."""
    return 1.0


def drift(world: World, share_in_10_s: float, length_s: float, number: int) -> tuple[int, list[int], float, int]:
    """Return drives alarmed again, alarms of each, the largest move without one, and drives alarmed before it began.

    The move is that of the resonance, over it: half of that of the stiffness.
    """

    def stiffness(time_s: float) -> float:
        return float((1.0 + share_in_10_s) ** (max(time_s - DRIFT_S, 0.0) / 10.0))

    alarms, unalarmed, early, end_s = [], 0.0, 0, DRIFT_S + length_s
    for seed in range(number):
        times = found_s(play(world(500 + seed, end_s, SCHEDULES["strong"], stiffness)))
        early += any(time_s < DRIFT_S for time_s in times)
        alarms.append(len(times))
        moments = [DRIFT_S, *(time_s for time_s in times if time_s >= DRIFT_S), end_s]
        moves = np.abs(np.diff(0.5 * np.log([stiffness(time_s) for time_s in moments])))
        unalarmed = max(unalarmed, float(moves.max()))
    return sum(count > 1 for count in alarms), alarms, unalarmed, early


def unchanged(world: World, prbs_nm: Course, hours: float) -> tuple[float, float, int, int, int]:
    """Return shares watched and not excited, watched alarms counted and as shipped, and those without PRBS."""
    watched, idle, counted, shipped, in_the_dark = [], [], 0, 0, 0
    for seed in range(max(round(hours * 3600.0 / DRIVE_S), 1)):
        record = world(900 + seed, DRIVE_S, prbs_nm, constant)
        course, usual = play(record, COUNTED), play(record)
        watched.append(float((course.state == TrackingState.WATCHING).mean()))
        idle.append(float((course.state == TrackingState.NOT_EXCITED).mean()))
        counted += len(found_s(course))
        shipped += len(found_s(usual))
        in_the_dark += sum(prbs_nm(time_s) == 0.0 for time_s in found_s(course) + found_s(usual))
    return float(np.mean(watched)), float(np.mean(idle)), counted, shipped, in_the_dark


def changed_while_off(world: World, share: float, number: int) -> tuple[int, float, int]:
    """Return drives in which a change of stiffness is found, the longest it took [s], and those alarmed before."""
    off_s, changed_s, on_s = 60.0, 90.0, 120.0
    took_s, early = [], 0
    for seed in range(number):
        record = world(
            700 + seed,
            200.0,
            lambda time_s: 0.0 if off_s <= time_s < on_s else STRONG_NM,
            lambda time_s: 1.0 + share * (time_s >= changed_s),
        )
        times = found_s(play(record))
        early += any(time_s < on_s for time_s in times)
        took_s += [time_s - on_s for time_s in times if time_s >= on_s][:1]
    return len(took_s), max(took_s, default=np.nan), early


def lines(hours: float, number: int) -> Iterator[str]:
    """Do it all; yield what came of it."""
    for name, world in WORLDS.items():
        yield f"{name}: stiffness drifts"
        for share, length_s in DRIFTS.items():
            again, alarms, moved, early = drift(world, share, length_s, number)
            yield (
                f"  {share:+.1%} in 10 s for {length_s:g} s: alarmed again {again} of {number}, {np.mean(alarms):.1f} "
                f"alarms a drive, resonance moved {moved:.1%} at most without one; {early} alarmed before it"
            )
        yield f"{name}: no change, {hours:g} h of each PRBS; at most {COUNTED.false_alarms_per_hour:g} an hour stated"
        for schedule, prbs_nm in SCHEDULES.items():
            watched, idle, counted, shipped, in_the_dark = unchanged(world, prbs_nm, hours)
            rate = f"{counted / (hours * watched):.1f} an hour" if watched else "none"
            yield (
                f"  {schedule:16}watched {watched:4.0%}, not excited {idle:4.0%}; of it watched came {rate}; "
                f"as shipped {shipped}; with the PRBS off {in_the_dark}"
            )
        for share in (-0.05, -0.15, 0.15):
            found, longest_s, early = changed_while_off(world, share, number)
            yield (
                f"{name}: stiffness {share:+.0%} while the PRBS is off: found {found} of {number}, at most "
                f"{longest_s:.0f} s after it was on again; {early} alarmed before"
            )


def main() -> None:
    """Run it all and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=2.0, help="of driving under each PRBS, in each world")
    parser.add_argument("--drives", type=int, default=10, help="under each drift and each change")
    given = parser.parse_args()
    for line in lines(given.hours, given.drives):
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
