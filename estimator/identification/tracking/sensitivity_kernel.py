"""Compiled: how the output depends on the natural frequency of one mode, from the torque alone.

A mode is the part rho / (1 - p q^-1) and its conjugate in the partial fractions of B / A. With the residue rho held,
its output changes with the natural frequency f by::

    psi(t) = dy/df = 2 Re [ rho dp/df q^-1 / (1 - p q^-1)^2 ] u(t),      dp/df = 2 pi T p (-zeta + j sqrt(1 - zeta^2))

What the torque does far below the resonance (driver, grade) goes into the rest of the model and hardly into psi: a pole
passed twice stands out of it by (|1 - p| / (1 - |p|))^2, some 300. It is the more so since not u but its steps
u(t) - u(t-1) are passed; whatever psi is held against, is taken in steps as well.
"""

from __future__ import annotations

import numpy as np

from estimator.compiled import compiled
from estimator.identification.tracking.pole_kernel import squared
from estimator.signals.record import FloatArray

# Places in `through`: the torque's steps passed once and twice through 1 / (1 - pole q^-1), and the last torque.
ONCE_RE, ONCE_IM, TWICE_RE, TWICE_IM, LAST = 0, 1, 2, 3, 4
N_THROUGH = 5


@compiled
def pass_torque(u: float, pole: complex, through: FloatArray) -> None:
    """Pass the next torque through a mode's pole."""
    once = pole * complex(through[ONCE_RE], through[ONCE_IM]) + (u - through[LAST])
    twice = pole * complex(through[TWICE_RE], through[TWICE_IM]) + once
    through[ONCE_RE], through[ONCE_IM], through[TWICE_RE], through[TWICE_IM] = (
        once.real,
        once.imag,
        twice.real,
        twice.imag,
    )
    through[LAST] = u


@compiled
def weight_of(pole: complex, residue: complex, damping: float, sample_time_s: float) -> complex:
    """Return rho dp/df, in the units of the output per Hz and torque."""
    turning = complex(-damping, np.sqrt(1.0 - damping * damping)) * (2.0 * np.pi * sample_time_s)
    return complex(residue * pole * turning)


@compiled
def sensitivity(weight: complex, through: FloatArray) -> float:
    """Return psi of the next sample's steps, from the torques passed so far."""
    return float(2.0 * (weight.real * through[TWICE_RE] - weight.imag * through[TWICE_IM]))


@compiled
def of_steps(pole: complex) -> float:
    """Return |1 - q^-1|^2 at the frequency of a pole: what taking steps makes of a density there."""
    return float(4.0 * np.sin(0.5 * np.arctan2(pole.imag, pole.real)) ** 2)


@compiled
def output_density(psi: float, pole: complex, half_width_hz: float) -> float:
    """Return a sample of the density at its peak of what the torque makes of the output [output unit squared].

    Over the half width zeta f, psi is the mode's own output, with the band of a pole passed twice: a white torque of
    variance 1 gives ``|rho|^2 / (1 - r)^2``, the peak, to first order in 1 - r.
    """
    r = np.sqrt(squared(pole))
    return float((half_width_hz * psi) ** 2 * (1.0 + r) / (1.0 - r) / of_steps(pole))
