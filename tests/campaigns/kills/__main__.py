"""``python -m tests.campaigns.kills [--kills N] [--seed N]``: recordings whose process is killed (SIGKILL).

Every second kill comes while samples are written, the others while the recording is published under its name, in every
format that is written. Prints a table, Markdown, of what is left; exits 1 if a row that the system had taken is lost,
or a file can't be read, or is not what was recorded.
"""

import argparse
import random
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

from hil.recording.formats import FORMATS
from tests.campaigns.kills.recording import Left, durations, killed, prepared

WRITABLE = [suffix for suffix, form in FORMATS.items() if form.write]

LATER = 1.05
"""Moments are drawn up to so much more than it takes without a kill."""


def campaign(folder: Path, kills: int, seed: int) -> dict[str, list[Left]]:
    """Kill recordings of all formats in turn."""
    context, found, takes_s = prepared(), defaultdict(list), {}
    for number in range(kills):
        suffix, dice = WRITABLE[number % len(WRITABLE)], random.Random(f"{seed}:{number}")
        publishing = (number + number // len(WRITABLE)) % 2 == 1
        with tempfile.TemporaryDirectory(dir=folder) as name:
            path = Path(name) / f"run{suffix}"
            if suffix not in takes_s:
                takes_s[suffix] = durations(context, Path(name) / f"whole{suffix}")
                for left in Path(name).iterdir():
                    left.unlink()
            at_s = dice.uniform(0.0, LATER * takes_s[suffix][publishing])
            left = killed(context, path, publishing, at_s)
        found[suffix].append(left)
        for problem in left.problems:
            print(f"kill {number}: {suffix}, {left.moment}: {problem}", file=sys.stderr, flush=True)
    return found


def report(found: dict[str, list[Left]]) -> int:
    """Print the table; 1 if there is a problem."""
    print("| format | kills | while writing | while publishing | after | most rows lost | wrong |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for suffix, each in found.items():
        moments = Counter(left.moment for left in each)
        counts = " | ".join(str(moments[moment]) for moment in ("writing", "publishing", "after"))
        lost, wrong = max(left.lost for left in each), sum(bool(left.problems) for left in each)
        print(f"| `{suffix}` | {len(each)} | {counts} | {lost} | {wrong} |")
    n_wrong = sum(bool(left.problems) for each in found.values() for left in each)
    print(f"\n{sum(map(len, found.values()))} kills, {n_wrong} wrong")
    return int(n_wrong > 0)


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.kills")
    parser.add_argument("--kills", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        return report(campaign(Path(name), asked.kills, asked.seed))


if __name__ == "__main__":
    sys.exit(main())
