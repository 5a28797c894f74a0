"""What the campaigns of faults share: how many runs, carried out one after the other, and their table."""

import argparse
import sys
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress

from tests.campaigns.faults.one_run import Outcome


def asked_for(program: str, runs: int, arguments: list[str] | None) -> argparse.Namespace:
    """Read how many runs are asked for, from which number on, and the seed of what is drawn."""
    parser = argparse.ArgumentParser(prog=f"python -m {program}")
    parser.add_argument("--runs", type=int, default=runs)
    parser.add_argument("--first", type=int, default=0, help="Number of the first run: parts can go at the same time.")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args(arguments)


WORST = "worst time to zero [s]"


def tried(asked: argparse.Namespace, one: Callable[[int], tuple[str, str, Outcome]], worst: str = WORST) -> int:
    """Carry the runs out, each of which gives its fault, where it was met, and how it ended; 1 if one is wrong.

    Whoever interrupts it gets the table of those until then.
    """
    outcomes: dict[str, list[Outcome]] = defaultdict(list)
    with suppress(KeyboardInterrupt):
        for number in range(asked.first, asked.first + asked.runs):
            kind, where, outcome = one(number)
            outcomes[kind].append(outcome)
            for problem in outcome.problems:
                print(f"run {number}: {kind} {where}: {problem}", file=sys.stderr, flush=True)
    return report(outcomes, worst)


def report(outcomes: dict[str, list[Outcome]], worst: str = WORST) -> int:
    """Print the table; 1 if there is a problem."""
    print(f"| fault | runs | ended by it | {worst} | wrong |")
    print("| --- | --- | --- | --- | --- |")
    for kind, each in outcomes.items():
        ended = [outcome for outcome in each if outcome.said]
        worst_s = max((outcome.zero_s for outcome in ended), default=0.0)
        wrong = sum(bool(outcome.problems) for outcome in each)
        print(f"| {kind} | {len(each)} | {len(ended)} | {worst_s:.2f} | {wrong} |")
    n_wrong = sum(bool(outcome.problems) for each in outcomes.values() for outcome in each)
    print(f"\n{sum(map(len, outcomes.values()))} runs, {n_wrong} wrong")
    return int(n_wrong > 0)
