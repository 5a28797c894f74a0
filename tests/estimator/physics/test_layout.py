"""Where each parameter stands in the kernel's vector, and what stands there without it."""

import math
import shutil
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from estimator import compiled as module
from estimator.compiled import compiled
from estimator.physics.catalogue import EFFECTS
from estimator.physics.layout import LOAD, NOMINAL, SIZE, flat, slot
from tests.estimator.physics.bench import TWO_MASS, model

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


def test_compiled_code_divides_as_arrays_do() -> None:
    def reciprocal(value: float) -> float:
        return 1.0 / value

    fast = compiled(reciprocal)
    assert isinstance(fast, Dispatcher)
    assert fast(4.0) == 0.25
    assert fast(0.0) == math.inf
    with pytest.raises(ZeroDivisionError):
        reciprocal(0.0)


class TestLayout:
    def test_every_parameter_has_a_slot_of_its_own(self) -> None:
        slots = [slot("", name) for name in (*NOMINAL, LOAD)]
        slots += [slot(entry.name, p.name) for entry in EFFECTS.values() for p in entry.parameters]
        assert sorted(slots) == list(range(SIZE))

    def test_effects_are_at_their_null_unless_the_model_has_them(self) -> None:
        vector = flat(model(TWO_MASS, effects={"backlash": {"gap_rad": 0.03}}))
        assert vector[slot("backlash", "gap_rad")] == 0.03
        assert vector[slot("backlash", "contact_rad")] == 0.0
        assert vector[slot("stiffness_nonlinearity", "shape")] == 1.0
