"""``python -m tests.campaigns.fuzz [--minutes M] [--inputs N] [--only NAME]``: readers and decoders, fed with mutants.

Each is tried in a process of its own. Prints a table, Markdown, of how many inputs there were, what became of them, the
longest time and the most memory; exits 1 if one ended with a traceback or a warning, took too long or too much. What
was wrong is kept in ``out/fuzz``: fixed, it belongs into ``tests/campaigns/fuzz/kept``.
"""

import argparse
import hashlib
import json
import math
import os
import selectors
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from tests.campaigns.fuzz.targets import TARGETS

HANG_S = 60.0
"""An input that takes longer hangs; a busy machine is no fault."""

SLOW_S = 20.0
"""An input of some kilobytes is read, or given up, within this."""

MOST_MIB = 1024.0

OUT = Path("out") / "fuzz"

FIRST_ANSWER_S = 600.0
"""Until the first answer: libraries are loaded, seeds made, and code is compiled for the first time."""


@dataclass
class Course:
    """What became of the inputs of one target."""

    inputs: int = 0
    read: int = 0
    slowest_s: float = 0.0
    most_mib: float = 0.0
    wrong: list[str] = field(default_factory=list)

    def take(self, line: dict[str, Any]) -> None:
        """Count one input."""
        self.inputs += 1
        self.read += line["read"]
        self.slowest_s = max(self.slowest_s, line["seconds"])
        if line["wrong"]:
            self.wrong.append(line["wrong"])
        elif line["seconds"] > SLOW_S:
            self.wrong.append(f"input {line['number']} took {line['seconds']:.1f} s")
        elif line["mib"] > MOST_MIB >= self.most_mib:
            self.wrong.append(f"input {line['number']} took {line['mib']:.0f} MiB")
        self.most_mib = max(self.most_mib, line["mib"])


def fuzz(name: str, seed: int, minutes: float, most: float = math.inf) -> Course:
    """Try mutants of one target for a time, or so many; its process is started anew where it ends."""
    course, number, end_s = Course(), 0, time.monotonic() + 60.0 * minutes
    while time.monotonic() < end_s and course.inputs < most:
        with _worker(name, seed, number) as answers:
            for line in _lines(answers, end_s):
                if line is None:
                    course.wrong.append(f"input {number} ended its process, or hangs")
                    number += 1
                    break
                course.take(line)
                number = max(number, line["number"] + 1)
                if line["wrong"]:
                    _keep(name, line)
                if course.inputs >= most:
                    break
    return course


@contextmanager
def _worker(name: str, seed: int, first: int) -> Iterator[IO[bytes]]:
    process = subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "tests.campaigns.fuzz.worker", name, str(seed), str(first)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdout is not None
    try:
        yield process.stdout
    finally:
        process.kill()
        process.communicate()


def _lines(answers: IO[bytes], end_s: float) -> Iterator[dict[str, Any] | None]:
    """Give what the process says of each input; None where it has ended, or says nothing any more."""
    patience_s, rest = FIRST_ANSWER_S, b""
    with selectors.DefaultSelector() as ready:
        ready.register(answers, selectors.EVENT_READ)
        while time.monotonic() < end_s or patience_s == FIRST_ANSWER_S:
            chunk = os.read(answers.fileno(), 1 << 20) if ready.select(patience_s) else b""
            if not chunk:
                yield None
                return
            *lines, rest = (rest + chunk).split(b"\n")
            yield from map(json.loads, lines)
            patience_s = HANG_S


def _keep(name: str, line: dict[str, Any]) -> None:
    """Keep an input that was wrong, and what was."""
    data = bytes.fromhex(line["data"])
    path = OUT / name / hashlib.sha256(data).hexdigest()[:12]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    path.with_suffix(".txt").write_text(line["wrong"])


def report(courses: dict[str, Course]) -> int:
    """Print the table; 1 if there is anything wrong."""
    print("| reader | inputs | read | refused | slowest [s] | memory [MiB] | wrong |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, course in courses.items():
        refused = course.inputs - course.read - len(course.wrong)
        counts = f"{course.inputs} | {course.read} | {refused} | {course.slowest_s:.1f} | {course.most_mib:.0f}"
        print(f"| {name} | {counts} | {len(course.wrong)} |")
    wrong = sum(len(course.wrong) for course in courses.values())
    print(f"\n{sum(course.inputs for course in courses.values())} inputs, {wrong} wrong")
    return int(wrong > 0)


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.fuzz")
    parser.add_argument("--minutes", type=float, default=5.0, help="For each target.")
    parser.add_argument("--inputs", type=int, default=math.inf, help="For each target, at most.")
    parser.add_argument("--only", action="append", choices=TARGETS)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    courses = {}
    for name in asked.only or TARGETS:
        course = courses[name] = fuzz(name, asked.seed, asked.minutes, asked.inputs)
        for problem in dict.fromkeys(course.wrong):
            print(f"{name}: {problem}", file=sys.stderr, flush=True)
    return report(courses)


if __name__ == "__main__":
    sys.exit(main())
