"""The campaign of fuzzing in short: forty mutants for each reader and bus decoder, always the same."""

import itertools
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from hil.errors import RecordingError
from tests.campaigns.fuzz.__main__ import MOST_MIB, Course, report
from tests.campaigns.fuzz.target import Read, Target
from tests.campaigns.fuzz.targets import TARGETS
from tests.campaigns.fuzz.trial import KEPT, trials

MUTANTS = {"modbus": 4, "store": 8, "mdf": 8}
"""Some wait for a time-out, start a process anew, or check more than others."""

SEED = 3


@pytest.mark.parametrize("name", TARGETS)
def test_mutants_are_read_or_refused_in_words(name: str) -> None:
    count = MUTANTS.get(name, 15)
    tried = list(itertools.takewhile(lambda trial: trial.number < count, trials(name, TARGETS[name], SEED, grow=False)))
    assert [trial.wrong for trial in tried if trial.wrong] == []
    assert any(trial.number < 0 and not trial.said for trial in tried), "no seed can be read: nothing is tested"


def test_what_is_kept_belongs_to_a_target() -> None:
    assert {path.name for path in KEPT.iterdir()} <= set(TARGETS)


def target(read: Read, names_file: bool = True) -> Target:
    @contextmanager
    def opened(folder: Path) -> Iterator[Read]:
        yield read

    return Target(lambda folder: [b"seed"], opened, names_file=names_file)


def fail(error: Exception) -> Any:
    raise error


WRONG = {
    "a defect": (lambda data: fail(KeyError("x")), "KeyError: 'x'"),
    "a refusal without a file": (lambda data: fail(RecordingError("other.csv", "no")), "names no file: .*other.csv"),
}


@pytest.mark.parametrize(("read", "wrong"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_noticed(read: Read, wrong: str) -> None:
    trial = next(trials("none", target(read), SEED))
    assert trial.number == -1
    assert re.search(wrong, trial.wrong)


def line(**said: Any) -> dict[str, Any]:
    return {"number": 1, "read": False, "wrong": "", "seconds": 0.1, "mib": 100.0, **said}


@pytest.mark.parametrize(
    ("said", "wrong"),
    [
        (line(), []),
        (line(wrong="KeyError"), ["KeyError"]),
        (line(seconds=30.0), ["input 1 took 30.0 s"]),
        (line(mib=MOST_MIB + 1), ["input 1 took 1025 MiB"]),
    ],
)
def test_time_and_memory_are_judged(said: dict[str, Any], wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    course = Course()
    course.take(line())
    course.take(said)
    assert course.wrong == wrong
    assert report({"csv": course}) == int(bool(wrong))
    assert f"2 inputs, {len(wrong)} wrong" in capsys.readouterr().out
