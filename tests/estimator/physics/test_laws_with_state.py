"""A law with a state at the motor or at the load: none of the catalogue, so one is put in their place."""

import subprocess
import sys

import pytest

LATE = """
import dataclasses, sys
from estimator.compiled import compiled
from estimator.physics.effect import Acting
from estimator.physics.effects import drag

@compiled
def law(speed, late, around, size, exponent, at):
    return late

@compiled
def rate(speed, late, around, size, exponent, at):
    return (size * speed - late) / 0.05

name = sys.argv[1]
entry = getattr(drag, name.upper())
setattr(drag, name.upper(), dataclasses.replace(entry, acting=Acting(entry.acting.place, law, rate)))

import numpy as np
from tests.estimator.physics import law_bench, reference

line = law_bench.TWO_MASS

def late(t, x, torque):
    drag_nm = {"friction" if name == "quadratic_friction" else "drag": lambda t, w: x[4]}
    moved = x[1] if name == "quadratic_friction" else x[3]
    return np.append(law_bench.two_mass(**drag_nm)(t, x[:4], torque), (8.0 * moved - x[4]) / 0.05)

start = np.append(law_bench.start_vector(), 0.0)
held = reference.Held.of(law_bench.TORQUE, law_bench.SAMPLE_TIME_S)
expected = reference.solve(late, start, held, law_bench.TIME_S)[:, reference.SPEED]
law_bench.assert_law({name: {sys.argv[2]: 8.0}}, expected)
"""
"""Drag that follows the speed with a lag of 50 ms: z' = (8 w - z) / 0.05."""


@pytest.mark.parametrize(
    ("name", "size"), [("quadratic_friction", "quadratic_nm_s2"), ("aerodynamic_drag", "drag_nm_s2")]
)
def test_a_law_with_a_state_acts_at_its_place(name: str, size: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")  # sooner run by Python than compiled with other laws
    done = subprocess.run([sys.executable, "-c", LATE, name, size], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
