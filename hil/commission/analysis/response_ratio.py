"""One inverter against the other: gain and delay from two frequency responses of the same driveline.

With the same PRBS on one inverter and then on the other, the driveline is the same in both tests and drops out::

    G_2(f) = g exp(-j 2 pi f tau) G_1(f)

``g`` is how much more torque inverter m2 gives for its reading than m1 does for its own, ``tau`` how much later. Both
by weighted least squares over the lines where both tests are coherent; the weights are Bendat and Piersol's random
errors (`estimator.identification.spectral`). Which of the two is right, no such test can tell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from estimator.signals.decimate import decimate
from estimator.signals.record import BoolArray, FloatArray, Record
from hil.commission.analysis.measured import Z95, Measured

if TYPE_CHECKING:
    from estimator.identification.spectral import SpectralEstimate

HIGH_PASS_HZ = 0.3
"""As in the identification: what is slower is the road's."""

LOW_HZ, HIGH_HZ = 0.8, 20.0
"""Lines used [Hz]: above twice the high-pass, below where a resolver's noise covers a driveline's response."""

COHERENT = 0.5
"""A line is used where at least half of the speed's power is the torque's, in both tests."""

SEGMENT_S = 2.56
"""Length of a segment: lines 0.4 Hz apart, narrower than a resonance of 8 Hz with 5 % damping (0.8 Hz)."""

FEWEST_LINES = 6


@dataclass(frozen=True, slots=True)
class ResponseRatio:
    """Gain of m2 over m1, and how much later m2 acts [s]; both undetermined with too few coherent lines."""

    gain: Measured
    delay_s: Measured
    lines: int


def response_ratio(first: Record, second: Record) -> ResponseRatio:
    """Compare the second test's response with the first's.

    Raises
    ------
    NotExciting
        If a recording has too few unbroken segments.
    """
    a, b = _response(first), _response(second)
    f = a.frequency_hz
    use = (f >= LOW_HZ) & (f <= HIGH_HZ) & (a.coherence >= COHERENT) & (b.coherence >= COHERENT)
    if int(use.sum()) < FEWEST_LINES:
        return ResponseRatio(Measured(1.0, np.inf), Measured(0.0, np.inf), int(use.sum()))
    return _ratio(a, b, use)


def _response(record: Record) -> SpectralEstimate:
    from estimator.identification.spectral import spectral_estimate  # half a second, and the bus comes first

    samples = 2 * round(SEGMENT_S / record.sample_time_s / 2)
    return spectral_estimate(decimate(record, 1, HIGH_PASS_HZ), samples)


def _ratio(a: SpectralEstimate, b: SpectralEstimate, use: BoolArray) -> ResponseRatio:
    omega = 2.0 * np.pi * a.frequency_hz[use]

    def errors(x: FloatArray) -> FloatArray:
        gain, delay_ms = x
        difference = b.response[use] - gain * np.exp(-1e-3j * omega * delay_ms) * a.response[use]
        spread = np.hypot(b.magnitude_std[use], gain * a.magnitude_std[use])
        return np.concatenate([difference.real / spread, difference.imag / spread])

    from scipy.optimize import least_squares

    start = float(np.real(np.vdot(a.response[use], b.response[use])) / np.sum(np.abs(a.response[use]) ** 2))
    found = least_squares(errors, [start, 0.0])
    jacobian = np.asarray(found.jac)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    misfit = max(1.0, 2.0 * found.cost / max(1, found.fun.shape[0] - 2))  # a driveline that changed between the tests
    gain_std, delay_std = np.sqrt(misfit * np.diag(covariance))
    return ResponseRatio(
        Measured(float(found.x[0]), Z95 * float(gain_std)),
        Measured(1e-3 * float(found.x[1]), 1e-3 * Z95 * float(delay_std)),
        int(use.sum()),
    )
