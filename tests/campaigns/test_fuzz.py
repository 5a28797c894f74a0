"""The campaign of fuzzing in short: a hundred mutants for each reader and bus decoder, always the same."""

from __future__ import annotations

import io
import itertools
import json
import os
import random
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from hil.errors import RecordingError
from tests.campaigns.fuzz.__main__ import MOST_MIB, Course, _lines, report
from tests.campaigns.fuzz.mutate import mutant
from tests.campaigns.fuzz.target import Read, Target
from tests.campaigns.fuzz.targets import TARGETS
from tests.campaigns.fuzz.trial import KEPT, trials

MUTANTS = {"modbus": 15, "store": 40, "mdf": 40}
"""Some wait for a time-out, start a process anew, or check more than others."""

SEED = 3


@pytest.mark.parametrize("name", TARGETS)
def test_mutants_are_read_or_refused_in_words(name: str) -> None:
    count = MUTANTS.get(name, 100)
    tried = list(itertools.takewhile(lambda trial: trial.number < count, trials(name, TARGETS[name], SEED, grow=False)))
    assert [trial.wrong for trial in tried if trial.wrong] == []
    assert any(trial.number < 0 and not trial.said for trial in tried), "no seed can be read: nothing is tested"


def test_what_is_kept_belongs_to_a_target() -> None:
    assert {path.name for path in KEPT.iterdir()} <= set(TARGETS)


def test_a_mutant_can_be_made_again() -> None:
    seeds = [b'{"a": 1.5}\n[b]\nc = 2', bytes(range(64))]
    for text in (False, True):
        first, again = ([mutant(seeds, random.Random(k), text) for k in range(200)] for _ in range(2))
        assert first == again
        assert len({*first} - {*seeds}) > 150


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


def test_a_refusal_that_names_the_file_is_none_of_it() -> None:
    trial = next(trials("none", target(lambda data: fail(RecordingError("input.csv", "no"))), SEED))
    assert (trial.said, trial.wrong) == ("RecordingError: input.csv: no", "")


def test_a_mutant_refused_in_new_words_becomes_a_seed() -> None:
    met: list[bytes] = []

    def read(data: bytes) -> None:
        met.append(data)
        fail(RecordingError("input", "long, " * (len(data) // 50)))

    grown = list(itertools.islice(trials("none", target(read), SEED), 300))
    longest, met = max(map(len, met)), []
    list(itertools.islice(trials("none", target(read), SEED, grow=False), 300))
    assert len(grown) == 300
    assert max(map(len, met)) < longest


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


def test_a_process_that_ended_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "said").write_text(json.dumps(line()) + "\n" + '{"number": 2')
    with _pipe((tmp_path / "said").read_bytes()) as answers:
        assert [None if said is None else said["number"] for said in _lines(answers, time.monotonic() + 60.0)] == [
            1,
            None,
        ]


@contextmanager
def _pipe(content: bytes) -> Iterator[io.BufferedReader]:
    out, into = os.pipe()
    os.write(into, content)
    os.close(into)
    with os.fdopen(out, "rb") as answers:
        yield answers
