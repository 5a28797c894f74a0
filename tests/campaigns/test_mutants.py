"""The campaign of mutants in short: its changes, and some of them tried."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.campaigns.mutants.__main__ import source_of
from tests.campaigns.mutants.changes import mutants
from tests.campaigns.mutants.targets import TARGETS

ROOT = Path(__file__).resolve().parents[2]


def changes(source: str) -> list[str]:
    return [mutant.change for mutant in mutants(source)]


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a < b", ["a < b -> a <= b", "a < b -> a >= b"]),
        ("a is None", ["a is None -> a is not None"]),
        ("a + 1", ["a + 1 -> a - 1", "1 -> 2"]),
        ("x = 1 << 3", ["1 << 3 -> 1 >> 3", "1 -> 2", "3 -> 4"]),
        ("a and not b", ["a and (not b) -> a or not b", "not b -> b"]),
        ("max(abs(a), 0.5)", ["max(abs(a), 0.5) -> min(abs(a), 0.5)", "abs(a) -> a", "0.5 -> 1.5"]),
        ("a if b else c", ["a if b else c -> c if b else a"]),
        ("True, True", ["True -> False", "True -> False #2"]),
        ("'text' + f'{a}'", []),
        ("C(slots=True, frozen=True)", ["True -> False"]),
    ],
)
def test_what_is_changed(source: str, expected: list[str]) -> None:
    assert changes(source) == expected


def test_a_mutant_is_the_module_with_one_change() -> None:
    first, second = mutants("def f(a):\n    return a < b")
    assert first.source == "def f(a):\n    return a <= b"
    assert second.source == "def f(a):\n    return a >= b"
    assert first.line == 2


@pytest.mark.campaign
@pytest.mark.parametrize("module", TARGETS)
def test_what_is_listed_is_a_change_there_is(module: str) -> None:
    assert set(TARGETS[module].equivalent) <= set(changes(source_of(module).read_text("utf-8")))


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_some_mutants_of_the_guard_are_all_found() -> None:
    """In processes of their own: this one has the modules loaded already."""
    modules = [option for name in ("drivers.torque_guard", "drivers.guard_limits") for option in ("--module", name)]
    command = [sys.executable, "-m", "tests.campaigns.mutants", "--every", "96", *modules]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout.splitlines()[-1].endswith("mutants, 0 live unlisted")
