"""``python -m tests.benchmarks.data_sheets``: every maker's file driven, and mutants of each.

A file that ``hil check --eds`` calls usable has to run, 400 samples with none flagged; one that it refuses has to be
refused with a line. Whatever else happens is a miss, and the exit status says so. The files lie outside the project,
in the folder ``eds`` of HIL_DATA.
"""

import argparse
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from drivers.datasheet.text import Severity
from drivers.eds_check import check_eds
from tests.drivers.maker_rig import SAMPLES, drive
from tests.drivers.mutants import mutants

DATA = Path(os.environ.get("HIL_DATA", Path(__file__).parents[3] / "shared" / "data"))
RAN, REFUSED = "ran", "refused by line"


def maker_files(folder: Path) -> list[Path]:
    """List the data sheets of a folder."""
    return sorted(path for path in folder.glob("*") if path.suffix.lower() in (".eds", ".dcf"))


def verdict(eds: Path, folder: Path, samples: int) -> str:
    """Check a file, and drive with it if it is usable: `RAN`, `REFUSED`, or what went wrong."""
    try:
        report = check_eds(eds)
        if not report.usable:
            lines = [each.line for each in report.findings if each.severity is Severity.ERROR]
            return REFUSED if any(line is not None for line in lines) else "refused without a line"
        driven = drive(eds, folder, samples)
    except Exception as error:  # noqa: BLE001 - every one is a miss, and is shown
        return f"{type(error).__name__}: {error}"
    if (driven.recorded, driven.flagged) != (samples, 0):
        return f"{driven.recorded} samples, {driven.flagged} flagged"
    return f"differs: {driven.before or driven.after}" if driven.before or driven.after else RAN


def mutant_verdicts(eds: Path, folder: Path, count: int, seed: int, samples: int) -> Iterator[tuple[str, str]]:
    """Judge mutants of one file: what was changed, and the verdict."""
    path = folder / eds.name
    for mutant in mutants(eds, count, seed):
        path.write_text(mutant.text, encoding="latin-1")
        yield str(mutant), verdict(path, folder, samples)


def main() -> int:
    """Drive every file and its mutants; 1 if anything was missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=DATA / "eds")
    parser.add_argument("--mutants", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--only", default="", help="part of a file's name")
    asked = parser.parse_args()
    misses = 0
    with tempfile.TemporaryDirectory() as name:
        for eds in maker_files(asked.data):
            if asked.only not in eds.name:
                continue
            found = verdict(eds, Path(name), asked.samples)
            misses += found not in (RAN, REFUSED)
            sys.stdout.write(f"{eds.name}: {found}\n")
            counts: Counter[str] = Counter()
            for changed, each in mutant_verdicts(eds, Path(name), asked.mutants, asked.seed, asked.samples):
                counts[each if each in (RAN, REFUSED) else "missed"] += 1
                if each not in (RAN, REFUSED):
                    misses += 1
                    sys.stdout.write(f"  {changed}: {each}\n")
            sys.stdout.write(f"  mutants: {dict(counts)}\n")
    return int(misses > 0)


if __name__ == "__main__":
    sys.exit(main())
