"""A drive whose motion is known in closed form: one mass, viscous friction, constant load, torque held.

J dw/dt = T - b w - T_0,  w[k+1] = a w[k] + (1 - a) (T[k] - T_0) / b,  a = exp(-b dt / J)
"""

import math
from pathlib import Path

import numpy as np

J, B, LOAD, DT = 2.0, 0.5, 3.0, 0.01

SUBSTEPS = 50
"""At a sign change the friction is late by a substep at most."""

MODEL = f"""schema = "hil.model/1"
structure = "one_mass"
motion = "rotation"

[parameters]
J_M = {{ value = {J}, tolerance = 0.2 }}
b_M = {{ value = {B}, tolerance = 0.2 }}
"""


def speed(torque: np.ndarray, start: float, dry: float = 0.0) -> np.ndarray:
    """Speed from torque; ``dry`` is a Coulomb friction too small to hold the mass, exact but at a sign change."""
    a = math.exp(-B * DT / SUBSTEPS / J)
    w = np.empty_like(torque)
    w[0] = start
    for k in range(torque.size - 1):
        now = w[k]
        for _ in range(SUBSTEPS):
            net = torque[k] - LOAD - math.copysign(dry, now)
            now = a * now + (1 - a) * net / B
        w[k + 1] = now
    return w


def angle(path: Path, w: np.ndarray) -> np.ndarray:
    """Angle of a recording from its speed ``w`` without noise: J dw + b w dt = (T - T_0) dt, summed up."""
    torque = 2.0 * np.loadtxt(path, delimiter=",", skiprows=1)[:, 1]
    driven = np.concatenate([[0.0], np.cumsum(torque[:-1] - LOAD) * DT])
    return (driven - J * (w - w[0])) / B


def record(
    path: Path, seed: int, *, noise: float = 0.0, dry: float = 0.0, n: int = 1500, reverse: bool = True
) -> np.ndarray:
    """Write a recording of the contract; return the speed without noise."""
    rng = np.random.default_rng(seed)
    t = DT * np.arange(n)
    torque = LOAD + 8.0 * np.sign(np.sin(0.9 * t + seed)) + (0.0 if reverse else 40.0)
    torque += 4.0 * rng.choice([-1.0, 1.0], size=n // 20 + 1).repeat(20)[:n]
    w = speed(torque, 1.0 if reverse else 60.0, dry)
    measured = w + noise * rng.normal(size=n)
    half = 0.5 * torque
    np.savetxt(
        path,
        np.column_stack([t, half, half, measured]),
        delimiter=",",
        header="time_s,torque_m1_nm,torque_m2_nm,speed_rad_s",
        comments="",
        fmt="%.12g",
    )
    return w


def model(path: Path, text: str = MODEL) -> Path:
    """Write a model file."""
    path.write_text(text)
    return path
