"""The compiled loop behind :mod:`estimator.identification.online.riv`; a single sample is a block of one."""

from __future__ import annotations

import numpy as np

from estimator.compiled import borrowing, compiled, inlined
from estimator.identification.online.gain_kernel import dot
from estimator.identification.online.regression_kernel import (
    IS_STABLE,
    LARGEST,
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

N_ROWS = 6
"""Rows of past values: outputs of the auxiliary model, measured outputs, torques (all by 1 / L);
outputs and torques as they came; parameters of the auxiliary model."""


@inlined
def opened_rows(memory: FloatArray, at: np.ndarray, structure: np.ndarray) -> tuple[FloatArray, ...]:
    """Return L and the rows of past values."""
    return (
        memory[at[8] : at[9]],
        past(memory, at, structure, 0),
        past(memory, at, structure, 1),
        past(memory, at, structure, 2),
        past(memory, at, structure, 3),
        past(memory, at, structure, 4),
        past(memory, at, structure, 5),
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
    aux_f: FloatArray,
    outputs_f: FloatArray,
    inputs_f: FloatArray,
    aux: FloatArray,
    inputs: FloatArray,
    kept: FloatArray,
    t: int,
    out: FloatArray,
) -> None:
    """Run one sample through the equations of the instrumental variable."""
    u = taken_input(u, structure, live, inputs)
    push(inputs_f, filtered(u, L, inputs_f))
    regressor(structure, aux, inputs, phi)
    simulated = kept_in_bounds(dot(kept, phi), y, False, live)
    push(aux, simulated)
    regressor(structure, outputs_f, inputs_f, phi)
    if live[USED] < structure[START_UP] or live[IS_STABLE] == 0.0:
        regressor(structure, outputs_f, inputs_f, Phi)
    else:
        regressor(structure, aux_f, inputs_f, Phi)
    used = is_usable(y, okay, live)
    y_f = filtered(y if okay and abs(y) <= LARGEST else simulated, L, outputs_f)
    e_prior, e_post = 0.0, 0.0
    if used:
        e_prior = y_f - dot(theta, phi)
        e_post = correct(e_prior, y, Phi, law, live, theta, U, D, known_U, known_D, diag, g, f)
    push(outputs_f, y_f)
    push(aux_f, filtered(simulated, L, aux_f))
    stable = is_stable(theta, structure[NA], f)
    live[IS_STABLE] = 1.0 if stable else 0.0
    if stable:
        for i in range(theta.shape[0]):
            kept[i] = theta[i]
    tell(theta, simulated, e_prior, e_post, used, verdict(structure, law, live, diag, stable), t, out)


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
    L, aux_f, outputs_f, inputs_f, aux, inputs, kept = opened_rows(memory, at, structure)
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
            aux_f,
            outputs_f,
            inputs_f,
            aux,
            inputs,
            kept,
            t,
            out,
        )
