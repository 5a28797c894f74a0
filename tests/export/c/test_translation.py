"""Python as the kernel is written in, in C: the same numbers, and a clear refusal of what has no counterpart."""

import ctypes
import math
import shutil
import subprocess
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest
from hypothesis import given, settings, strategies as st

from estimator.lanes import choose, every
from estimator.physics import laws
from estimator.physics.effects.dry_friction import stribeck_law
from estimator.physics.effects.load import coupling
from estimator.physics.effects.timing import low_pass
from hil.export.c_laws import NotTranslatable, Translation
from hil.export.fmu.package import OPTIONS


class Pair(NamedTuple):
    first: float
    second: float


def swapped(a: float, b: float) -> float:
    a, b = b, a
    pair = Pair(a, b)
    both = pair.first, pair.second
    return combined(*both)


def combined(a: float, b: float) -> float:
    total, count = 0.0, 0
    while count < 5:
        count += 1
        if count == 2:
            continue
        total += a / count - (b if 0.0 <= a < 1.0 else -b) * float(count > 3)
    for i in range(3):
        total -= i
    return choose(every(not total < 0.0), min(total, 100.0), abs(total))


combined.__module__ = "estimator.for_a_test"  # where laws are


def of_laws(speed: float, size: float) -> float:
    friction = stribeck_law(speed, 3.0, size, 0.7, 0.01, 0.0) * laws.smooth_sign(speed, 0.01)
    slope, share = coupling(speed, 1e-3, 0.5, 0.1, 40.0)
    low = low_pass(abs(size) + 1e-3, 0.3, 0.01)
    gap = laws.beyond_gap(speed, size)
    return friction + slope * share + low.rise_of_rise + gap + laws.fading(abs(speed)) + speed**2


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Any]:
    folder = tmp_path_factory.mktemp("c")
    unit = Translation()
    text = [f"double {name}_(double a, double b) {{ return {name}(a, b); }}" for name in (
        unit.function(swapped)[0], unit.function(of_laws)[0])]  # fmt: skip
    (folder / "laws.c").write_text("\n".join((unit.text(), *text)))
    compiler = shutil.which("cc") or shutil.which("gcc") or "cc"
    subprocess.run([compiler, *OPTIONS, "laws.c", "-o", "laws.so", "-lm"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "laws.so"))

    def function(name: str) -> Any:
        found = getattr(library, name)
        found.restype, found.argtypes = ctypes.c_double, [ctypes.c_double, ctypes.c_double]
        return found

    return function


NUMBERS = st.floats(-50.0, 50.0)


@settings(deadline=None)
@given(NUMBERS, NUMBERS)
def test_the_numbers_are_those_of_python(compiled: Callable[[str], Any], a: float, b: float) -> None:
    for function in (swapped, of_laws):
        expected = function(a, b)
        found = compiled(f"test_translation_{function.__name__}_")(a, b)
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-12) or math.isnan(expected)


def listed(a: float) -> float:
    return sum([a, a])


def opened(a: float) -> float:
    with open("law") as file:
        return float(file.read()) * a


def of_two_kinds(a: float) -> float:
    held = Pair(a, a)
    held = a
    return held


@pytest.mark.parametrize("function", [listed, opened, of_two_kinds])
def test_what_has_no_counterpart_is_refused_by_name(function: Callable[[float], float]) -> None:
    with pytest.raises(NotTranslatable, match=r"expected"):
        Translation().function(function)
