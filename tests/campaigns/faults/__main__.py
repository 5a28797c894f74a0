"""``python -m tests.campaigns.faults [--runs N] [--first N] [--seed N]``: faults at random moments of every experiment.

Prints a table, Markdown, of the worst time to zero torque for each fault; exits 1 if a run was not as it must be: a
torque above a limit or left, a drive not disarmed, a recording damaged, a wrong cause.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from hil.config.rig_file import Rig
from tests.campaigns.faults.kinds import KINDS, UNTOUCHED
from tests.campaigns.faults.one_run import Outcome, run_with
from tests.campaigns.faults.rig import campaign_rig


def lengths(rig: Rig, folder: Path) -> dict[str, int]:
    """Run every experiment without a fault: SYNCs of each."""
    steps = {}
    for experiment in rig.experiments:
        outcome = run_with(rig, experiment, UNTOUCHED, 1e6, folder)
        if outcome.problems or outcome.said:
            raise SystemExit(f"{experiment} without a fault: {outcome.said} {outcome.problems}")
        steps[experiment] = outcome.steps
    return steps


def draw(number: int, seed: int, steps: dict[str, int], period_s: float) -> tuple[str, str, float]:
    """Draw fault, experiment and moment of one run: the faults in turn, all else at random."""
    random_numbers = random.Random(f"{seed}:{number}")
    kind = list(KINDS)[number % len(KINDS)]
    experiment = random_numbers.choice(sorted(steps))
    return kind, experiment, random_numbers.randrange(1, steps[experiment]) * period_s


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.faults")
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="Number of the first run: parts can go at the same time.")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    outcomes: dict[str, list[Outcome]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig = campaign_rig(folder)
        steps = lengths(rig, folder)
        for number in range(asked.first, asked.first + asked.runs):
            kind, experiment, at_s = draw(number, asked.seed, steps, rig.period_s)
            outcome = run_with(rig, experiment, KINDS[kind], at_s, folder, steps[experiment])
            outcomes[kind].append(outcome)
            for problem in outcome.problems:
                print(f"run {number}: {kind} at {at_s:.2f} s of {experiment}: {problem}", file=sys.stderr, flush=True)
    return report(outcomes)


def report(outcomes: dict[str, list[Outcome]]) -> int:
    """Print the table; 1 if there is a problem."""
    print("| fault | runs | ended by it | worst time to zero [s] | wrong |")
    print("| --- | --- | --- | --- | --- |")
    for kind, each in outcomes.items():
        ended = [outcome for outcome in each if outcome.said]
        worst_s = max((outcome.zero_s for outcome in ended), default=0.0)
        wrong = sum(bool(outcome.problems) for outcome in each)
        print(f"| {kind} | {len(each)} | {len(ended)} | {worst_s:.2f} | {wrong} |")
    n_wrong = sum(bool(outcome.problems) for each in outcomes.values() for outcome in each)
    print(f"\n{sum(map(len, outcomes.values()))} runs, {n_wrong} wrong")
    return int(n_wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
