"""Where each parameter stands in the kernel's vector, and what stands there without it."""

import math
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from estimator import compiled as module
from estimator.compiled import compiled
from estimator.physics.catalogue import KERNEL
from estimator.physics.layout import LOAD, NOMINAL, OBSERVER, SIZE, flat, slot
from tests.estimator.physics.bench import TWO_MASS, model


@pytest.fixture
def sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a package with a kernel, a law that it imports, and a file that neither imports."""
    package = tmp_path / "estimator"
    package.mkdir()
    (package / "kernel.py").write_text("def run():\n    from estimator import law\n\n    return law.drag(1.0)\n")
    (package / "law.py").write_text('"""A law."""\n\n\ndef drag(speed):\n    """Return it."""\n    return speed\n')
    (package / "other.py").write_text("OTHER = 1\n")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "take", lambda folder: None)
    yield package
    forget()


def forget() -> None:
    """Forget what was read of source files, as a new process has."""
    for cached in (module._code, module._imports, module._sources, module.cache_folder):
        cached.cache_clear()


def folder_after(kernel: Path, changed: Path, text: str) -> Path:
    """Return where a kernel is kept once a source file has another text."""
    changed.write_text(text)
    forget()
    return module.cache_folder(kernel)


def test_a_kernel_is_kept_for_as_long_as_no_code_that_it_may_contain_has_changed(sources: Path, tmp_path: Path) -> None:
    kernel, law = sources / "kernel.py", sources / "law.py"
    before = module.cache_folder(kernel)
    assert folder_after(kernel, sources / "other.py", "OTHER = 2\n") == before
    in_words = '"""Another,\nof two."""\n\n\ndef drag(speed):\n    """Return\n    it."""\n    # why\n    return speed\n'
    assert folder_after(kernel, law, in_words) == before
    assert folder_after(kernel, law, "def drag(speed):\n    return 0.0\n") != before
    copied = Path(shutil.copytree(sources, tmp_path / "copy" / "estimator")) / "kernel.py"
    here = module.cache_folder(kernel)
    module.ROOT = tmp_path / "copy"
    forget()
    assert module.cache_folder(copied) == here


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
        slots = [slot("", name) for name in (*NOMINAL, LOAD, OBSERVER)]
        slots += [slot(entry.name, p.name) for entry in KERNEL.values() for p in entry.parameters]
        assert sorted(slots) == list(range(SIZE))

    def test_effects_are_at_their_null_unless_the_model_has_them(self) -> None:
        vector = flat(model(TWO_MASS, effects={"backlash": {"gap_rad": 0.03}}))
        assert vector[slot("backlash", "gap_rad")] == 0.03
        assert vector[slot("backlash", "contact_rad")] == 0.0
        assert vector[slot("stiffness_nonlinearity", "shape")] == 1.0
