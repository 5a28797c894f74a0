"""The compiled loop behind :mod:`estimator.identification.online.oefo`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np

from estimator.compiled import borrowing, compiled, inlined
from estimator.identification.online.gain_kernel import dot
from estimator.identification.online.regression_kernel import (
    ADAPT_FILTER,
    NA,
    START_UP,
    USED,
    correct,
    filtered,
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

N_ROWS = 4
"""Rows of past values: predicted outputs, torques, and both filtered by 1 / L."""


@inlined
def opened_rows(memory: FloatArray, at: np.ndarray, structure: np.ndarray) -> tuple[FloatArray, ...]:
    """Return L and the rows of past values."""
    return (
        memory[at[8] : at[9]],
        past(memory, at, structure, 0),
        past(memory, at, structure, 1),
        past(memory, at, structure, 2),
        past(memory, at, structure, 3),
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
    L: FloatArray,
    outputs: FloatArray,
    outputs_f: FloatArray,
    inputs: FloatArray,
    inputs_f: FloatArray,
    t: int,
    out: FloatArray,
) -> None:
    """Run one sample through equations (1) to (7)."""
    u = taken_input(u, structure, live, inputs)
    push(inputs_f, filtered(u, L, inputs_f))
    regressor(structure, outputs, inputs, phi)
    if live[USED] < structure[START_UP]:
        regressor(structure, outputs, inputs, Phi)
    else:
        regressor(structure, outputs_f, inputs_f, Phi)
    y_hat = dot(theta, phi)
    used = is_usable(y, okay, live)
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = y - y_hat
        e_post = correct(e_prior, y, Phi, law, live, theta, U, D, known_U, known_D, diag, g, f)
        y_hat = dot(theta, phi)
    y_hat = kept_in_bounds(y_hat, y, used, live)
    stable = is_stable(theta, structure[NA], f)
    if stable and structure[ADAPT_FILTER] == 1:
        for i in range(structure[NA]):
            L[1 + i] = theta[i]
    push(outputs, y_hat)
    push(outputs_f, filtered(y_hat, L, outputs_f))
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
    L, outputs, outputs_f, inputs, inputs_f = opened_rows(memory, at, structure)
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
            L,
            outputs,
            outputs_f,
            inputs,
            inputs_f,
            t,
            out,
        )
