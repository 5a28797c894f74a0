"""Who waits for a compiler is told so, and waits for both cores."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from numba.core import config as numba_config

from estimator.diagnosis import diagnose, first_use
from estimator.diagnosis.first_use import COMPILING, SIGNATURES, is_first_use
from tests.estimator.diagnosis.planted import quiet
from tests.estimator.physics.bench import ONE_MASS, model

COUNT_KEPT = """
from estimator.diagnosis import diagnose
from estimator.diagnosis.first_use import SIGNATURES, compile_kernels, is_first_use
from tests.benchmarks.cases import make
assert is_first_use()
compile_kernels()
assert not is_first_use()
case = make("backlash", 1)
diagnose(case.records, case.model)
for kernel in SIGNATURES:
    print(kernel.__name__, sum(kernel.stats.cache_misses.values()), len(kernel._cache._cache_file._load_index()))
"""


@pytest.mark.parametrize("compiles", [True, False])
def test_where_nothing_has_been_kept_it_is_the_first_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiles: bool
) -> None:
    monkeypatch.setitem(vars(numba_config), "CACHE_DIR", str(tmp_path / "kernel"))
    monkeypatch.setattr(first_use, "IS_COMPILED", compiles)
    assert is_first_use() is compiles
    (tmp_path / "kernel" / "abreast").mkdir(parents=True)
    assert is_first_use() is compiles


@pytest.mark.parametrize("first", [True, False])
def test_a_diagnosis_says_at_every_stage_that_it_compiles(first: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """And compiles before all else. Once it is done there is something on disk."""
    stages: list[str] = []
    job = import_module("estimator.diagnosis.diagnose")
    monkeypatch.setattr(job, "is_first_use", lambda: first)
    monkeypatch.setattr(job, "compile_kernels", lambda: stages.append(f"compiling itself ({COMPILING})"))
    diagnose(quiet(values=ONE_MASS, samples=1200), model(ONE_MASS), (), lambda stage, _: stages.append(stage))
    assert [stage.split(" (")[0] for stage in stages[:3]] == (
        ["preparing", "compiling itself", "checking the recordings"]
        if first
        else ["checking the recordings", "fitting the nominal model", "looking at every effect"]
    )
    assert {COMPILING in stage for stage in stages} == {first}
    assert not is_first_use()


def test_what_is_on_disk_is_what_is_called() -> None:
    """Nothing is compiled anew for the types that are written down."""
    diagnose(quiet(values=ONE_MASS, samples=1200), model(ONE_MASS))
    had = {kernel: sum(kernel.stats.cache_misses.values()) for kernel in SIGNATURES}
    for kernel, signature in SIGNATURES.items():
        kernel.compile(signature)
    assert {kernel: sum(kernel.stats.cache_misses.values()) for kernel in SIGNATURES} == had


@pytest.mark.campaign
@pytest.mark.timeout(1200)
def test_two_processes_leave_on_disk_all_that_a_diagnosis_calls(tmp_path: Path) -> None:
    """Of each kernel one is kept, and none was compiled here."""
    done = subprocess.run(
        [sys.executable, "-c", COUNT_KEPT],
        env={**os.environ, "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines() == [
        "integrate 0 1",
        "integrate_side_by_side 0 1",
        "integrate_each 0 1",
        "linearise 0 1",
    ]
