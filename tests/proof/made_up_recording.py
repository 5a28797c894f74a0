"""A small made-up recording in a folder of its own, as a real one would be: a mass with drag under a known load."""

import hashlib
from pathlib import Path

import numpy as np

PERIOD_S, N = 0.1, 400
MASS_KG, VISCOUS, DRAG = 100.0, 8.0, 0.5

MODEL = """
schema = "hil.model/1"
structure = "one_mass"
motion = "translation"

[parameters]
J_M = { value = 100.0, tolerance = 0.1 }
b_M = { value = 8.0, tolerance = 0.5 }

[signals]
time = { column = "t" }
torque = [ { column = "force" } ]
speed = { column = "speed" }
"""
"""Mass and viscous friction as they are; the drag is left out."""

TRUTH = f"""
schema = "hil.real-truth/1"
source = "made up"

[[values]]
what = "drag"
found = "effects.aerodynamic_drag.drag_nm_s2"
value = {DRAG}
unit = "N s^2/m^2"
within = 0.1
"""

CASE = """
schema = "hil.real-case/1"
title = "A made-up trolley"
concealed = ["aerodynamic_drag"]
conceals = "drag"
shown = ["t", "force", "speed"]
withheld = ["secret"]

[recordings.first]
path = "trolley/a.csv"
sha256 = "{a}"
origin = {{ page = "https://example.org/trolley" }}

[recordings.second]
path = "trolley/b.csv"
sha256 = "{b}"
origin = {{ page = "https://example.org/trolley", url = "http://127.0.0.1:1/b.csv" }}

[[runs]]
name = "only"
fit = ["first"]
held_out = ["second"]
"""


def force_n(seed: int) -> np.ndarray:
    """Return a force that changes every second, shape (N,)."""
    steps = np.random.default_rng(seed).uniform(100.0, 600.0, N // 10)
    return np.repeat(steps, 10)


def speed_m_s(force: np.ndarray, load_n: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the speed under a force and a load, explicit Euler from 5 m/s, shape (N,)."""
    load = np.broadcast_to(load_n, force.shape)
    speed = np.empty(N)
    v = 5.0
    for k in range(N):
        speed[k] = v
        v += PERIOD_S / MASS_KG * (force[k] - VISCOUS * v - DRAG * v * abs(v) - load[k])
    return speed


def write_recording(path: Path, seed: int) -> str:
    """Write a recording with a channel that tells the drag; return its checksum."""
    path.parent.mkdir(parents=True, exist_ok=True)
    force = force_n(seed)
    speed = speed_m_s(force)
    columns = np.column_stack([np.arange(N) * PERIOD_S, force, speed, DRAG * speed**2])
    rows = "\n".join(",".join(repr(float(value)) for value in row) for row in columns)
    path.write_text(f"t,force,speed,secret\n{rows}\n")
    return hashlib.sha256(path.read_bytes()).hexdigest()


def write_case(room: Path, data: Path, *, case: str = CASE, name: str = "trolley") -> Path:
    """Write two recordings and the folder of a case; return the folder."""
    sums = {key: write_recording(data / "trolley" / f"{key}.csv", seed) for seed, key in enumerate("ab")}
    folder = room / name
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(case.format(**sums))
    (folder / "model.toml").write_text(MODEL)
    (folder / "truth.toml").write_text(TRUTH)
    (folder / "provenance.md").write_text("# Made up\n")
    return folder
