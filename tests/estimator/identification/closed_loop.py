"""The tests' driveline with a controller that answers the measured speed, and its exact frequency response."""

import numpy as np
from scipy.signal import max_len_seq

from estimator.signals.decimate import decimate
from estimator.signals.record import FloatArray, Record
from tests.estimator.identification.driveline import LINE, SAMPLE_TIME_S, K

SPEED_RAD_S, LOAD_NM, PRBS_NM = 120.0, 150.0, 60.0


def controlled(
    seed: int, gain: float, duration_s: float = 40.0, noise_rad_s: float = 0.05
) -> tuple[Record, FloatArray]:
    """Drive with ``torque = 300 + PRBS - gain (speed - 120)`` [Nm, Nm s/rad]; return the record and its PRBS.

    Both have passed the high-pass of the identification. The speed that is answered is the measured one, so that sensor
    noise comes back through the torque.
    """
    rng = np.random.default_rng(seed)
    n = round(duration_s / SAMPLE_TIME_S)
    prbs = PRBS_NM * (2.0 * np.resize(max_len_seq(10, state=rng.permutation([1] * 5 + [0] * 5))[0], n) - 1.0)
    load = LOAD_NM + np.cumsum(rng.normal(0, 0.5, n))
    noise = rng.normal(0, noise_rad_s, n)
    Ad, Bd = LINE.discrete(SAMPLE_TIME_S)
    x = np.array([SPEED_RAD_S, SPEED_RAD_S, LOAD_NM / K])
    torque, speed = np.empty(n), np.empty(n)
    for k in range(n):
        speed[k] = x[0] + noise[k]
        torque[k] = 300.0 + prbs[k] - gain * (speed[k] - SPEED_RAD_S)
        x = Ad @ x + Bd @ np.array([torque[k], load[k]])
    record, reference = (_prepared(signal, speed) for signal in (torque, prbs))
    return record, reference.total_torque_nm


def _prepared(torque_nm: FloatArray, speed_rad_s: FloatArray) -> Record:
    n = speed_rad_s.shape[0]
    time_s = SAMPLE_TIME_S * np.arange(n)
    return decimate(
        Record("loop", SAMPLE_TIME_S, time_s, torque_nm[:, np.newaxis], speed_rad_s, np.ones(n, dtype=bool)), 1
    )


def response(frequency_hz: FloatArray) -> FloatArray:
    """Magnitude of the exact response of sampled motor speed to held motor torque [rad/s per Nm]."""
    Ad, Bd = LINE.discrete(SAMPLE_TIME_S)
    z = np.exp(2j * np.pi * frequency_hz * SAMPLE_TIME_S)
    return np.array([abs(np.linalg.solve(at * np.eye(3) - Ad, Bd[:, 0])[0]) for at in z])
