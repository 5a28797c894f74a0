"""``python -m tests.campaigns.faults [--runs N] [--first N] [--seed N]``: faults at random moments of every experiment.

Prints a table, Markdown, of the worst time to zero torque for each fault; exits 1 if a run was not as it must be: a
torque above a limit or left, a drive not disarmed, a recording damaged, a wrong cause.
"""

import random
import sys
import tempfile
from pathlib import Path

from hil.config.rig_file import Rig
from tests.campaigns.faults.kinds import KINDS, UNTOUCHED
from tests.campaigns.faults.one_run import Outcome, run_with
from tests.campaigns.faults.rig import campaign_rig
from tests.campaigns.faults.runs import asked_for, tried


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
    asked = asked_for("tests.campaigns.faults", 10_000, arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig = campaign_rig(folder)
        steps = lengths(rig, folder)

        def one(number: int) -> tuple[str, str, Outcome]:
            kind, experiment, at_s = draw(number, asked.seed, steps, rig.period_s)
            outcome = run_with(rig, experiment, KINDS[kind], at_s, folder, steps[experiment])
            return kind, f"at {at_s:.2f} s of {experiment}", outcome

        return tried(asked, one)


if __name__ == "__main__":
    sys.exit(main())
