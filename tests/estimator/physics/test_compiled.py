"""Compiled code is machine code, and its cache does not outlive a changed law."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from estimator import compiled as module
from estimator.compiled import compiled

SOURCE = Path(module.__file__).parent


@pytest.fixture
def copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the sources that the module takes for its own."""
    for package in module.PACKAGES:
        shutil.copytree(SOURCE / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(SOURCE / "compiled.py", tmp_path)
    monkeypatch.setattr(module, "__file__", str(tmp_path / "compiled.py"))
    return tmp_path


def test_a_copy_of_the_sources_has_the_same_digest(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_copy = module._digest()
    monkeypatch.setattr(module, "__file__", str(SOURCE / "compiled.py"))
    assert module._digest() == in_copy


@pytest.mark.parametrize("changed", ["physics/effects/backlash.py", "physics/layout.py", "compiled.py"])
def test_a_changed_source_changes_the_digest(copy: Path, changed: str) -> None:
    before = module._digest()
    with (copy / changed).open("a") as file:
        file.write("# another law\n")
    assert module._digest() != before


def test_the_cache_lies_where_the_user_keeps_caches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert module._cache_folder() == tmp_path / "hil" / f"kernel-{module._digest()}"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert module._cache_folder().parent == tmp_path / ".cache" / "hil"


def test_compiled_code_divides_as_arrays_do() -> None:
    def reciprocal(value: float) -> float:
        return 1.0 / value

    fast = compiled(reciprocal)
    assert isinstance(fast, Dispatcher)
    assert fast(4.0) == 0.25
    assert fast(0.0) == math.inf
    with pytest.raises(ZeroDivisionError):
        reciprocal(0.0)
