"""The resonance while driving, against the truth: ``python -m tests.benchmarks.tracking [--hours H] [--runs N]``.

1. **Spread**: of many drives without change, the scatter of resonance and damping over the standard deviation the
   chain gives on line. 1 is right, below 1 is careful, above is too sure. And how many of the 95 % intervals hold the
   truth.
2. **False alarms**: over hours in which nothing changes, at a rate high enough to be counted and with no change
   tolerated, so that the statistics decide and nothing else; then with the settings as shipped.
3. **Delay**: from a drop of the stiffness by 5, 10 and 20 % to its alarm, in a drive whose mass has changed before.
4. **Speed**: samples per second in blocks, and what one sample costs on the rig.
"""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import poisson

from estimator.identification.chain import OnlineChain
from estimator.identification.settings import Settings
from estimator.identification.tracking.watch import WatchSettings
from estimator.signals.record import Record
from hil.rig.live import tracking_settings
from tests.estimator.identification.tracking.drives import SAMPLE_TIME_S, Line, drives

AT_ONCE = 8
"""Hours simulated side by side."""

COUNTED_PER_HOUR = 20.0
MOMENTS = (400, 600, 1000, 2000, 2900)
CHANGE_S = 70.0
CONDITIONS: tuple[tuple[str, Settings, dict[str, float]], ...] = (
    ("paper's profile, noise of 1 rad/s", Settings(), {"noise_rad_s": 1.0, "road_nm": 0.0}),
    ("forgetting, noise of 0.5 rad/s", tracking_settings(), {"noise_rad_s": 0.5, "road_nm": 0.0}),
    ("forgetting, rough road", tracking_settings(), {"road_nm": 1000.0}),
    ("forgetting, the rig's noise alone", tracking_settings(), {"road_nm": 0.0}),
)


def spread(runs: int, settings: Settings, **conditions: float) -> list[tuple[int, float, float, float, float]]:
    """Return sample, scatter over deviation and coverage of the resonance, and of the damping."""
    truth = np.array(Line().resonance)
    errors = []
    for record in drives(1, runs, 61.0, **conditions):
        course = OnlineChain(settings, SAMPLE_TIME_S).run(record)
        at = list(MOMENTS)
        found = np.array([course.frequency_hz[at], course.damping[at]])
        errors.append((found - truth[:, np.newaxis]) / np.array([course.frequency_std_hz[at], course.damping_std[at]]))
    z = np.array(errors)  # run, quantity, moment
    rows = []
    for j, moment in enumerate(MOMENTS):
        known = z[np.isfinite(z[:, :, j]).all(axis=1), :, j]
        scatter, inside = np.sqrt((known**2).mean(axis=0)), (np.abs(known) < 1.96).mean(axis=0)
        rows.append((moment, scatter[0], inside[0], scatter[1], inside[1]))
    return rows


def hours(seed: int, number: int, **conditions: float) -> Iterator[Record]:
    """Simulate hours without change."""
    for first in range(0, number, AT_ONCE):
        yield from drives(seed + first, min(AT_ONCE, number - first), 3600.0, **conditions)


def false_alarms(watches: Sequence[WatchSettings], number: int, seed: int = 100, **conditions: float) -> list[int]:
    """Count the alarms of hours in which nothing changes, with each of the settings."""
    counts = [0] * len(watches)
    for record in hours(seed, number, **conditions):
        for i, watch in enumerate(watches):
            course = OnlineChain(tracking_settings(), SAMPLE_TIME_S, watch=watch).run(record)
            counts[i] += sum(not alarm.settled for alarm in course.alarms)
    return counts


def delays(drop: float, runs: int, seed: int = 7) -> tuple[np.ndarray, int, int]:
    """Return the delays of the alarms [s], how many came before the change, and how many intervals hold the truth."""
    after = Line(CHANGE_S, k=4200.0 * (1.0 - drop), J_L=130.0)
    lines = (Line(), Line(40.0, J_L=130.0), after)
    found, early, held = [], 0, 0
    for record in drives(seed, runs, CHANGE_S + 40.0, lines):
        alarms = OnlineChain(tracking_settings(), SAMPLE_TIME_S).run(record).alarms
        early += any(alarm.time_s < CHANGE_S for alarm in alarms)
        late = [alarm for alarm in alarms if alarm.time_s >= CHANGE_S]
        found += [alarm.time_s - CHANGE_S for alarm in late if not alarm.settled][:1]
        settled = [alarm.after.ci95 for alarm in late if alarm.settled][:1]
        held += sum(low <= after.resonance[0] <= high for low, high in settled)
    return np.array(found), early, held


def speed(record: Record) -> tuple[float, float]:
    """Return samples per second in blocks, and the time of one sample pushed by itself [us]."""
    chain = OnlineChain(tracking_settings(), SAMPLE_TIME_S)
    signals = (record.time_s, record.total_torque_nm, record.output, record.okay)
    chain.run_block(*(values[:10_000] for values in signals))
    begun = time.process_time()
    for first in range(0, record.time_s.shape[0], 10_000):
        chain.run_block(*(values[first : first + 10_000] for values in signals))
    in_blocks = record.time_s.shape[0] / (time.process_time() - begun)
    rows = list(zip(*(values[:5000].tolist() for values in signals), strict=True))
    begun = time.process_time()
    for row in rows:
        chain.push(*row)
    return in_blocks, (time.process_time() - begun) / len(rows) * 1e6


def lines(runs: int, number: int) -> Iterator[str]:
    """Do it all; yield what came of it."""
    for name, settings, conditions in CONDITIONS:
        yield f"spread, {name}: {runs} drives"
        for row in spread(runs, settings, **conditions):
            yield "  after {:4d} samples: resonance {:.2f} ({:.0%}), damping {:.2f} ({:.0%})".format(*row)
    counted, shipped = WatchSettings(COUNTED_PER_HOUR, smallest_change=0.0), WatchSettings()
    for road_nm in (100.0, 1000.0):
        count, as_shipped = false_alarms((counted, shipped), number, road_nm=road_nm)
        low, high = (bound / number for bound in poisson.interval(0.95, max(count, 1)))
        yield (
            f"false alarms, road {road_nm:g} Nm: stated at most {COUNTED_PER_HOUR:g} an hour, got "
            f"{count / number:.2f} ({low:.2f} to {high:.2f}) in {number} h"
        )
        yield f"  as shipped: stated at most {shipped.false_alarms_per_hour} an hour, got {as_shipped} in all"
    for drop in (0.05, 0.1, 0.2):
        found, early, held = delays(drop, runs)
        yield (
            f"stiffness drops by {drop:.0%}: {found.size} of {runs} found, after {np.median(found):.1f} s (median), "
            f"{found.max():.1f} s (longest); {early} alarms before it; {held} intervals after settling hold the truth"
        )
    in_blocks, one_us = speed(drives(3, 1, 3600.0)[0])
    yield f"of processor time: {in_blocks / 1e6:.2f} million samples per second in blocks; {one_us:.0f} us one by one"


def main() -> None:
    """Run it all and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=int, default=24)
    parser.add_argument("--runs", type=int, default=60)
    given = parser.parse_args()
    for line in lines(given.runs, given.hours):
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
