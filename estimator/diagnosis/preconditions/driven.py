"""What the recorded torque does to the output by a nominal model: the yardstick for excitation and units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import detrend

from estimator.physics.driveline import Start
from estimator.physics.grid import Grid
from estimator.physics.layout import flat
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, Record


def driven(record: Record, line: DrivelineModel, grid: Grid, from_hz: float = 0.0, to_hz: float = np.inf) -> FloatArray:
    """Simulate the output that the torque of a band of frequencies makes from rest; shape (N,) [unit of the output].

    The torque is taken without its mean; above 0 Hz without its trend, too.
    """
    torque = record.total_torque_nm - record.total_torque_nm.mean()
    if from_hz > 0.0 or to_hz < np.inf:
        frequency = np.fft.rfftfreq(torque.size, record.sample_time_s)
        spectrum = np.fft.rfft(detrend(torque))
        spectrum[(frequency < from_hz) | (frequency > to_hz)] = 0.0
        torque = np.fft.irfft(spectrum, torque.size)
    alone = replace(record, torque_nm=torque[:, np.newaxis], load_nm=None, torque_okay=None, offset_s=None)
    return simulate(grid, alone, flat(line), Start(0.0, 0.0, 0.0))
