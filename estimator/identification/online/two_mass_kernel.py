"""Compiled: the two-mass driveline over one sampling period, with its derivatives.

::

    J_M dw_M/dt = u - c (w_M - w_L) - k s - b_M w_M
    J_L dw_L/dt =     c (w_M - w_L) + k s - b_L w_L - T_0
        ds/dt   = w_M - w_L

The torque is held over the period, so that the motion is linear in (w_M, w_L, s, T_0, u) and its Taylor series is
summed until nothing is left; the derivatives with respect to the state, T_0, the logarithms of J_M, J_L, k, c, and u
obey the same equations and are summed next to it.
"""

from __future__ import annotations

from estimator.compiled import inlined
from estimator.signals.record import FloatArray

# Columns that are propagated: the motion, then its derivatives.
MOTION = 0
BY_STATE = 1  # three columns: by w_M, w_L, s
BY_LOAD = 4
BY_LOG = 5  # four columns: by ln J_M, ln J_L, ln k, ln c
BY_TORQUE = 9
N_COLUMNS = 10

TERMS = 16  # 1 / 16! = 5e-14 of a part of the period whose largest rate times length is 1
MOST_PARTS = 128


@inlined
def rate(x: FloatArray, column: int, forced: float, load: float, p: FloatArray, out: FloatArray) -> None:
    """Set a column of ``out`` to the time derivative of one of ``x`` under a torque and a load; p as in the filter."""
    J_M, J_L, k, c, b_M, b_L = p[0], p[1], p[2], p[3], p[4], p[5]
    slip = x[0, column] - x[1, column]
    shaft = c * slip + k * x[2, column]
    out[0, column] = (forced - shaft - b_M * x[0, column]) / J_M
    out[1, column] = (shaft - b_L * x[1, column] - load) / J_L
    out[2, column] = slip


@inlined
def rates(x: FloatArray, torque: float, load: float, unit: float, p: FloatArray, out: FloatArray) -> None:
    """Differentiate all columns; ``unit`` is 1 where the inputs act (first derivative) and 0 above it."""
    rate(x, MOTION, torque * unit, load * unit, p, out)
    for column in range(BY_STATE, BY_LOAD):
        rate(x, column, 0.0, 0.0, p, out)
    rate(x, BY_LOAD, 0.0, unit, p, out)
    for column in range(BY_LOG, BY_TORQUE):
        rate(x, column, 0.0, 0.0, p, out)
    rate(x, BY_TORQUE, unit, 0.0, p, out)
    out[0, BY_LOG] -= out[0, MOTION]
    out[1, BY_LOG + 1] -= out[1, MOTION]
    spring, damper = p[2] * x[2, MOTION], p[3] * (x[0, MOTION] - x[1, MOTION])
    out[0, BY_LOG + 2] -= spring / p[0]
    out[1, BY_LOG + 2] += spring / p[1]
    out[0, BY_LOG + 3] -= damper / p[0]
    out[1, BY_LOG + 3] += damper / p[1]


@inlined
def parts_of(period_s: float, p: FloatArray) -> int:
    """Return how many parts to cut a period into, so that the series of each converges at once."""
    fastest = (p[2] * (1.0 / p[0] + 1.0 / p[1])) ** 0.5 + (p[3] + p[4]) / p[0] + (p[3] + p[5]) / p[1]
    return int(min(1.0 + period_s * fastest, float(MOST_PARTS)))


@inlined
def propagate(
    x: FloatArray,
    torque: float,
    load: float,
    period_s: float,
    p: FloatArray,
    term: FloatArray,
    following: FloatArray,
) -> None:
    """Move ``x``, shape (3, N_COLUMNS), on by one period; the derivatives are set up here.

    ``p`` holds J_M, J_L, k, c, b_M, b_L; ``term`` and ``following`` are room of the shape of x.
    """
    for row in range(3):
        for column in range(1, N_COLUMNS):
            x[row, column] = 1.0 if column == BY_STATE + row else 0.0
    parts = parts_of(period_s, p)
    length_s = period_s / parts
    for _ in range(parts):
        for row in range(3):
            for column in range(N_COLUMNS):
                term[row, column] = x[row, column]
        for order in range(1, TERMS + 1):
            rates(term, torque, load, 1.0 if order == 1 else 0.0, p, following)
            weight = length_s / order
            for row in range(3):
                for column in range(N_COLUMNS):
                    term[row, column] = weight * following[row, column]
                    x[row, column] += term[row, column]


@inlined
def transfer_function(x: FloatArray, theta: FloatArray) -> None:
    """Set theta = a_1 .. a_3, b_1 .. b_3 of speed over torque from the propagated columns (Leverrier, Markov)."""
    a00, a01, a02 = x[0, 1], x[0, 2], x[0, 3]
    a10, a11, a12 = x[1, 1], x[1, 2], x[1, 3]
    a20, a21, a22 = x[2, 1], x[2, 2], x[2, 3]
    b0, b1, b2 = x[0, BY_TORQUE], x[1, BY_TORQUE], x[2, BY_TORQUE]
    c0, c1, c2 = a00 * b0 + a01 * b1 + a02 * b2, a10 * b0 + a11 * b1 + a12 * b2, a20 * b0 + a21 * b1 + a22 * b2
    minors = a00 * a11 - a01 * a10 + a00 * a22 - a02 * a20 + a11 * a22 - a12 * a21
    determinant = a00 * (a11 * a22 - a12 * a21) - a01 * (a10 * a22 - a12 * a20) + a02 * (a10 * a21 - a11 * a20)
    theta[0] = -(a00 + a11 + a22)
    theta[1] = minors
    theta[2] = -determinant
    theta[3] = b0
    theta[4] = c0 + theta[0] * b0
    theta[5] = a00 * c0 + a01 * c1 + a02 * c2 + theta[0] * c0 + theta[1] * b0
