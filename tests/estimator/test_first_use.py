"""Who waits for a compiler is told so."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest
from numba.core import config as numba_config

from estimator import first_use
from estimator.diagnosis import diagnose
from estimator.first_use import COMPILING, is_first_use
from tests.estimator.diagnosis.planted import quiet
from tests.estimator.physics.bench import ONE_MASS, model


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
    """Once it is done there is something on disk."""
    monkeypatch.setattr(import_module("estimator.diagnosis.diagnose"), "is_first_use", lambda: first)
    stages: list[str] = []
    diagnose(quiet(values=ONE_MASS, samples=1200), model(ONE_MASS), (), lambda stage, _: stages.append(stage))
    assert stages[0].startswith("checking the recordings")
    assert {COMPILING in stage for stage in stages} == {first}
    assert not is_first_use()
