"""How far a free run is off, in one measure for every model, black boxes included."""

from __future__ import annotations

import numpy as np
from scipy.signal import savgol_filter

from estimator.physics.model import DrivelineModel
from estimator.signals.record import BoolArray, FloatArray, Record
from hil.proof.real.case_file import Measure

WINDOW_S = 1.0
"""Error of the speed to error of the force: slopes over this time; the speed reading's noise would drown shorter ones.
A driver moves the pedal more slowly."""

DRAGS = {"aerodynamic_drag": "drag_nm_s2", "quadratic_friction": "quadratic_nm_s2"}


def error_of(
    measure: Measure, record: Record, simulated: FloatArray, judged: BoolArray, model: DrivelineModel
) -> float:
    """Return the error of a simulated output.

    Parameters
    ----------
    record
        What was measured, nothing hidden.
    simulated : ndarray, shape (N,)
        Output; a value that is not finite makes the error infinite.
    judged : ndarray of bool, shape (N,)
        Samples that count.
    model
        Turns an error of the speed into one of the force (`Measure.FORCE_NRMSE`).

    Returns
    -------
    float
        In the output's unit or, for a normalised measure, without one.
    """
    if not np.isfinite(simulated[judged]).all():
        return float("inf")
    error = simulated - record.output
    scale = 1.0
    if measure is Measure.NRMSE:
        scale = float(np.std(record.output[judged]))
    elif measure is Measure.FORCE_NRMSE:
        error = force_error(record, simulated, model)
        judged = judged & np.isfinite(error)
        scale = float(np.std(record.total_torque_nm[judged]))
    return float(np.sqrt(np.mean(error[judged] ** 2))) / scale


def force_error(record: Record, simulated: FloatArray, model: DrivelineModel) -> FloatArray:
    """Return the force that a simulated speed lacks against the measured one, shape (N,) [N; rotation Nm].

    ``J d(v_sim - v) / dt + b (v_sim - v) + q (v_sim |v_sim| - v |v|)`` of a one-mass model: what would have to be added
    to the measured force to follow the measured speed. NaN where the speed was not measured for a whole window.
    """
    values = model.values()
    drag = sum(model.effects[name][key].value for name, key in DRAGS.items() if name in model.effects)
    speed = np.where(record.okay, record.output, np.nan)
    samples = max(round(WINDOW_S / record.sample_time_s) // 2 * 2 + 1, 3)
    slope = savgol_filter(
        simulated - speed, samples, 1, deriv=1, delta=record.sample_time_s, mode="constant", cval=np.nan
    )
    loss = values["b_M"] * (simulated - speed) + drag * (simulated * np.abs(simulated) - speed * np.abs(speed))
    error: FloatArray = values["J_M"] * slope + loss
    return error


def load_course(record: Record, simulated: FloatArray, model: DrivelineModel) -> FloatArray:
    """Return the load that a one-mass model's free run was under, shape (N,) [N; rotation Nm].

    The simulated speed is free of noise, so the force balance gives it back: ``F - J dv_sim/dt - b v - q v |v|``.
    """
    values = model.values()
    drag = sum(model.effects[name][key].value for name, key in DRAGS.items() if name in model.effects)
    slope = np.append(np.diff(simulated), np.nan) / record.sample_time_s
    loss = values["b_M"] * simulated + drag * simulated * np.abs(simulated)
    load: FloatArray = record.total_torque_nm - values["J_M"] * slope - loss
    return load
