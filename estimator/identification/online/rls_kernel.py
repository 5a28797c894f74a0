"""The compiled loop behind :mod:`estimator.identification.online.rls`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np

from estimator.compiled import borrowing, compiled, inlined
from estimator.identification.online.gain_kernel import dot
from estimator.identification.online.regression_kernel import (
    HELD_OUTPUTS,
    LARGEST,
    NA,
    correct,
    is_stable,
    is_usable,
    kept_in_bounds,
    opened,
    past,
    push,
    regressor,
    taken_input,
    tell,
    verdict,
)
from estimator.signals.record import BoolArray, FloatArray

N_ROWS = 2
"""Rows of past values: measured outputs, torques."""


@inlined
def opened_rows(memory: FloatArray, at: np.ndarray, structure: np.ndarray) -> tuple[FloatArray, ...]:
    """Return the rows of past values."""
    return (
        past(memory, at, structure, 0),
        past(memory, at, structure, 1),
    )


@borrowing
def step(
    u: float,
    y: float,
    okay: bool,
    structure: np.ndarray,
    law: FloatArray,
    live: FloatArray,
    theta: FloatArray,
    U: FloatArray,
    D: FloatArray,
    known_U: FloatArray,
    known_D: FloatArray,
    diag: FloatArray,
    phi: FloatArray,
    Phi: FloatArray,
    g: FloatArray,
    f: FloatArray,
    outputs: FloatArray,
    inputs: FloatArray,
    t: int,
    out: FloatArray,
) -> None:
    """Run one sample through the equations of recursive least squares."""
    taken_input(u, structure, live, inputs)
    regressor(structure, outputs, inputs, phi)
    y_hat = dot(theta, phi)
    measured = okay and abs(y) <= LARGEST
    used = is_usable(y, okay, live) and live[HELD_OUTPUTS] == 0.0
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = y - y_hat
        e_post = correct(e_prior, y, phi, law, live, theta, U, D, known_U, known_D, diag, g, f)
        y_hat = dot(theta, phi)
    y_hat = kept_in_bounds(y_hat, y, used, live)
    live[HELD_OUTPUTS] = max(live[HELD_OUTPUTS] - 1.0, 0.0) if measured else float(structure[NA])
    push(outputs, y if measured else y_hat)
    stable = is_stable(theta, structure[NA], f)
    tell(theta, y_hat, e_prior, e_post, used, verdict(structure, law, live, diag, stable), t, out)


@compiled
def block(
    u: FloatArray,
    y: FloatArray,
    okay: BoolArray,
    structure: np.ndarray,
    law: FloatArray,
    memory: FloatArray,
    at: np.ndarray,
    out: FloatArray,
) -> None:
    """Run the samples of a block through, each into its row of ``out``."""
    live, theta, U, D, known_U, known_D, diag, phi, Phi, g, f = opened(memory, at, structure)
    outputs, inputs = opened_rows(memory, at, structure)
    for t in range(u.shape[0]):
        step(
            u[t],
            y[t],
            okay[t],
            structure,
            law,
            live,
            theta,
            U,
            D,
            known_U,
            known_D,
            diag,
            phi,
            Phi,
            g,
            f,
            outputs,
            inputs,
            t,
            out,
        )
