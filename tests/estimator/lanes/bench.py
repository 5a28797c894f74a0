"""A function of numbers called once with eight of each in lanes, and eight times with one."""

from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np

from estimator.lanes import LANES, as_lanes
from estimator.signals.record import FloatArray


def in_both_ways(function: Callable[..., Any], arguments: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return a compiled function's results, shape (N,), in lanes and one by one, for arguments of shape (N,) each."""
    rows = [np.ascontiguousarray(argument).reshape(-1, LANES) for argument in arguments]
    together, alone = np.empty_like(rows[0]), np.empty(rows[0].size)
    WAYS[len(arguments) - 1](function, tuple(rows), together)
    for i, values in enumerate(zip(*arguments, strict=True)):
        alone[i] = function(*values)
    return together.ravel(), alone


@numba.njit(error_model="numpy")
def of_one(function: Any, rows: Any, out: Any) -> None:
    to, x = as_lanes(out), as_lanes(rows[0])
    for i in range(out.shape[0]):
        to[i] = function(x[i])


@numba.njit(error_model="numpy")
def of_two(function: Any, rows: Any, out: Any) -> None:
    to, x, y = as_lanes(out), as_lanes(rows[0]), as_lanes(rows[1])
    for i in range(out.shape[0]):
        to[i] = function(x[i], y[i])


@numba.njit(error_model="numpy")
def of_three(function: Any, rows: Any, out: Any) -> None:
    to, x, y, z = as_lanes(out), as_lanes(rows[0]), as_lanes(rows[1]), as_lanes(rows[2])
    for i in range(out.shape[0]):
        to[i] = function(x[i], y[i], z[i])


@numba.njit(error_model="numpy")
def of_four(function: Any, rows: Any, out: Any) -> None:
    to, x, y, z, u = as_lanes(out), as_lanes(rows[0]), as_lanes(rows[1]), as_lanes(rows[2]), as_lanes(rows[3])
    for i in range(out.shape[0]):
        to[i] = function(x[i], y[i], z[i], u[i])


@numba.njit(error_model="numpy")
def of_five(function: Any, rows: Any, out: Any) -> None:
    to, x, y, z = as_lanes(out), as_lanes(rows[0]), as_lanes(rows[1]), as_lanes(rows[2])
    u, v = as_lanes(rows[3]), as_lanes(rows[4])
    for i in range(out.shape[0]):
        to[i] = function(x[i], y[i], z[i], u[i], v[i])


@numba.njit(error_model="numpy")
def of_six(function: Any, rows: Any, out: Any) -> None:
    to, x, y, z = as_lanes(out), as_lanes(rows[0]), as_lanes(rows[1]), as_lanes(rows[2])
    u, v, w = as_lanes(rows[3]), as_lanes(rows[4]), as_lanes(rows[5])
    for i in range(out.shape[0]):
        to[i] = function(x[i], y[i], z[i], u[i], v[i], w[i])


@numba.njit(error_model="numpy")
def of_seven(function: Any, rows: Any, out: Any) -> None:
    to, x, y, z = as_lanes(out), as_lanes(rows[0]), as_lanes(rows[1]), as_lanes(rows[2])
    u, v, w, q = as_lanes(rows[3]), as_lanes(rows[4]), as_lanes(rows[5]), as_lanes(rows[6])
    for i in range(out.shape[0]):
        to[i] = function(x[i], y[i], z[i], u[i], v[i], w[i], q[i])


WAYS = (of_one, of_two, of_three, of_four, of_five, of_six, of_seven)
"""Compiled code is given its arguments one by one."""
