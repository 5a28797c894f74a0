"""``python -W error -m tests.campaigns.fuzz.worker NAME SEED FIRST``: tries mutants of one target until it is ended.

Says of each, in one line of JSON, its number, what became of it, its time and the memory so far. Whoever started it
sees by that line, or by its missing, where it died or hangs.
"""

import json
import resource
import sys

from tests.campaigns.fuzz.targets import TARGETS
from tests.campaigns.fuzz.trial import memory_mib, trials

MOST_BYTES = 3 << 30
"""Of address space: the machine is not to be harmed by what is found."""


def main() -> None:
    """Try mutants without end."""
    name, seed, first = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    answers, sys.stdout = sys.stdout, sys.stderr
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, resource.RLIM_INFINITY))
    for trial in trials(name, TARGETS[name], seed, first):
        line = {"number": trial.number, "read": not trial.said, "wrong": trial.wrong, "seconds": trial.seconds}
        if trial.wrong:
            line["data"] = trial.data.hex()
        print(json.dumps({**line, "mib": memory_mib()}), file=answers, flush=True)


if __name__ == "__main__":
    main()
