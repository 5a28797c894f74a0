"""A run that waits for the compiler says so, and compiles on both cores."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

from estimator.diagnosis import diagnose
from estimator.diagnosis.first_use import COMPILING, signatures
from estimator.physics.effect import Element
from estimator.physics.layout import named
from estimator.physics.own_law import OwnLaw, OwnParameter
from tests.estimator.diagnosis.planted import quiet
from tests.estimator.physics.bench import ONE_MASS, model

COUNT_KEPT = """
from estimator.diagnosis import diagnose
from estimator.diagnosis.first_use import compile_kernels, is_first_use, signatures
from tests.benchmarks.cases import make
assert is_first_use(2)
compile_kernels(2)
assert not is_first_use(2)
assert is_first_use(3)
case = make("backlash", 1)
diagnose(case.records, case.model)
for kernel in signatures(2):
    print(kernel.__name__, sum(kernel.stats.cache_misses.values()), len(kernel._cache._cache_file._load_index()))
"""


FOUND_KEPT = """
from pathlib import Path
from estimator.diagnosis.first_use import is_first_use
from estimator.physics.kernel.side_by_side import integrate_side_by_side
here = Path(integrate_side_by_side.stats.cache_path)
for place in (here.with_name("kernel_of_another_installation"), here):
    print(is_first_use(2))
    place.mkdir(parents=True, exist_ok=True)
    (place / "compiled_for_2").touch()
print(is_first_use(2))
"""


def test_it_is_the_first_use_where_nothing_has_been_kept_for_this_place(tmp_path: Path) -> None:
    """The same version in another place has kernels of its own, which numba doesn't look for here."""
    done = _in_a_process_of_its_own(FOUND_KEPT, tmp_path)
    assert done.split() == ["True", "True", "False"]


@pytest.mark.parametrize("first", [True, False])
def test_a_diagnosis_says_at_every_stage_that_it_compiles(first: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """And compiles before all else."""
    stages: list[str] = []
    job = import_module("estimator.diagnosis.first_use")
    monkeypatch.setattr(job, "is_first_use", lambda masses: first)
    monkeypatch.setattr(job, "compile_kernels", lambda masses: stages.append(f"compiling itself ({COMPILING})"))
    diagnose(quiet(values=ONE_MASS, samples=1200), model(ONE_MASS), (), lambda stage, _: stages.append(stage))
    assert list(dict.fromkeys(stage.split(" (")[0] for stage in stages))[:3] == (
        ["preparing", "compiling itself", "checking the recordings"]
        if first
        else ["checking the recordings", "comparing hypotheses", "weighing what was found"]
    )
    assert {COMPILING in stage for stage in stages} == {first}


def test_what_is_on_disk_is_what_is_called() -> None:
    """Nothing is compiled anew for the types that are written down."""
    diagnose(quiet(values=ONE_MASS, samples=1200), model(ONE_MASS))
    had = {kernel: sum(kernel.stats.cache_misses.values()) for kernel in signatures(1)}
    for kernel, signature in signatures(1).items():
        kernel.compile(signature)
    assert {kernel: sum(kernel.stats.cache_misses.values()) for kernel in signatures(1)} == had


def test_a_models_own_laws_are_compiled_before_a_diagnosis_counts_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The budget is for the search: compiling within it would leave no time for that."""
    asked = []

    def noted(t: float, w: float, load: float, twist: float, torque: float, size: float) -> float:
        asked.append(f"{w}")
        return size * w

    def answered(*_: object) -> None:
        raise InterruptedError(f"asked {len(asked)} times")

    plain = model(ONE_MASS)
    owner = replace(plain, laws=named([OwnLaw("mine", noted, Element.MOTOR, (OwnParameter("size", "", 0, 0, 9, 1),))]))
    asked.clear()  # it was tried when it was read
    monkeypatch.setattr(import_module("estimator.diagnosis.diagnose"), "answer", answered)
    with pytest.raises(InterruptedError, match=r"asked [1-9]\d* times"):
        diagnose(quiet(values=ONE_MASS, samples=1200), owner)


@pytest.mark.campaign
@pytest.mark.timeout(1200)
def test_two_processes_leave_on_disk_all_that_a_diagnosis_calls(tmp_path: Path) -> None:
    """Of each kernel one is kept, and none was compiled here."""
    done = _in_a_process_of_its_own(COUNT_KEPT, tmp_path)
    assert done.splitlines() == [f"{kernel.__name__} 0 1" for kernel in signatures(2)]


def _in_a_process_of_its_own(program: str, cache: Path) -> str:
    """Return what a program prints that has nothing on disk yet."""
    return subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "XDG_CACHE_HOME": str(cache), "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
