"""What the tests of physics and diagnosis share: models, torques, and a linear driveline solved exactly by scipy."""

from collections.abc import Mapping

import numpy as np
from scipy.signal import cont2discrete

from estimator.physics.driveline import InitialCondition
from estimator.physics.model import DrivelineModel, EffectValue, Motion, Parameter, Structure
from estimator.signals.record import BoolArray, FloatArray, Location, OutputKind, Record

SAMPLE_TIME_S = 0.01

TWO_MASS = {"J_M": 1.6, "J_L": 40.0, "k": 4200.0, "c": 9.0, "b_M": 0.35, "b_L": 0.9}
ONE_MASS = {"J_M": 20.0, "b_M": 4.0}
THREE_MASS = TWO_MASS | {"J_2": 0.9, "k": 9000.0, "c": 7.0, "k_2": 6000.0, "c_2": 11.0}

ANGLE, SPEED, TWIST, LOAD_SPEED = range(4)
"""States of the matrices below."""


def model(
    values: Mapping[str, float],
    tolerance: float = 0.2,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    motion: Motion = Motion.ROTATION,
) -> DrivelineModel:
    """Build a model from plain values; its structure is the one that has them."""
    structure = Structure.TWO_MASS if "k" in values else Structure.ONE_MASS
    return DrivelineModel(
        structure,
        {name: Parameter(value, tolerance if value else 0.0) for name, value in values.items()},
        motion,
        {name: {key: EffectValue(v) for key, v in e.items()} for name, e in (effects or {}).items()},
    )


def assert_same_to_rounding(actual: FloatArray, desired: FloatArray) -> None:
    """Outputs are the same whether a linear line took sub-steps or their sum (``kernel.linear``), to rounding."""
    np.testing.assert_allclose(actual, desired, rtol=0.0, atol=1e-11 * np.ptp(desired))


def scaled(values: Mapping[str, float], **factors: float) -> dict[str, float]:
    """Multiply some of the values."""
    return {name: value * factors.get(name, 1.0) for name, value in values.items()}


def random_steps(samples: int, seed: int, size_nm: float = 100.0, hold: int = 10, mean_nm: float = 0.0) -> FloatArray:
    """Torque of either sign that keeps its value for ``hold`` samples; shape (samples,)."""
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=-(-samples // hold))
    return mean_nm + size_nm * np.repeat(signs, hold)[:samples]


def record(
    torque_nm: FloatArray,
    output: FloatArray | None = None,
    *,
    name: str = "run",
    sample_time_s: float = SAMPLE_TIME_S,
    kind: OutputKind = OutputKind.SPEED,
    location: Location = Location.MOTOR,
    okay: BoolArray | None = None,
) -> Record:
    """Wrap signals in a recording; a torque of shape (N,) is one input."""
    torque = torque_nm[:, None] if torque_nm.ndim == 1 else torque_nm
    n = torque.shape[0]
    return Record(
        name,
        sample_time_s,
        np.arange(n) * sample_time_s,
        torque,
        np.zeros(n) if output is None else output,
        np.ones(n, dtype=bool) if okay is None else okay,
        kind,
        location,
    )


def matrices(values: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
    """A and B of ``dx/dt = A x + B [T, T_0]``, written down from Newton's law; one mass keeps the last states still."""
    A, B = np.zeros((4, 4)), np.zeros((4, 2))
    j_m, b_m = values["J_M"], values["b_M"]
    A[ANGLE, SPEED] = 1.0
    if "k" not in values:
        A[SPEED, SPEED] = -b_m / j_m
        B[SPEED] = 1.0 / j_m, -1.0 / j_m
        return A, B
    j_l, b_l, k, c = (values[name] for name in ("J_L", "b_L", "k", "c"))
    A[SPEED] = 0.0, -(c + b_m) / j_m, -k / j_m, c / j_m
    A[TWIST] = 0.0, 1.0, 0.0, -1.0
    A[LOAD_SPEED] = 0.0, c / j_l, k / j_l, -(c + b_l) / j_l
    B[SPEED, 0], B[LOAD_SPEED, 1] = 1.0 / j_m, -1.0 / j_l
    return A, B


def exact_states(
    values: Mapping[str, float],
    torque_nm: FloatArray,
    start: InitialCondition,
    sample_time_s: float = SAMPLE_TIME_S,
    extra_load_nm: FloatArray | None = None,
) -> FloatArray:
    """States of the linear driveline under a zero-order-held torque, shape (N, 4), by the matrix exponential."""
    A, B = matrices(values)
    advance, drive, *_ = cont2discrete((A, B, np.eye(4), np.zeros((4, 2))), sample_time_s)
    load = np.full_like(torque_nm, start.load_torque_nm) + (0.0 if extra_load_nm is None else extra_load_nm)
    driven = np.column_stack([torque_nm, load]) @ drive.T
    states = np.empty((torque_nm.size, 4))
    states[0] = start.angle_rad, start.speed_rad_s, start.twist_rad, start.load_speed_rad_s
    for k in range(torque_nm.size - 1):
        states[k + 1] = advance @ states[k] + driven[k]
    return states


def linear_record(
    values: Mapping[str, float],
    torque_nm: FloatArray,
    start: InitialCondition,
    *,
    sigma: float = 0.0,
    seed: int = 0,
    name: str = "run",
    kind: OutputKind = OutputKind.SPEED,
    location: Location = Location.MOTOR,
    extra_load_nm: FloatArray | None = None,
) -> Record:
    """Recording of the exact linear driveline, with white noise of ``sigma`` on the output."""
    states = exact_states(values, torque_nm, start, extra_load_nm=extra_load_nm)
    state = ANGLE if kind is OutputKind.POSITION else LOAD_SPEED if location is Location.LOAD else SPEED
    noise = sigma * np.random.default_rng(seed).standard_normal(torque_nm.size)
    return record(torque_nm, states[:, state] + noise, name=name, kind=kind, location=location)
