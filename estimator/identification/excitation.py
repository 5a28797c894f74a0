"""Whether the data can determine the model asked for; refused here, before any fit can look good.

An input excites persistently of order p if its p delayed copies are linearly independent; p of them determine
p parameters (L. Ljung, System Identification, 2nd ed., chapter 13: a sine gives 2, a constant 1, a PRBS its
period).
"""

from __future__ import annotations

import numpy as np

from estimator.errors import NotExciting
from estimator.identification.linear_model import Orders
from estimator.identification.triangular import singular_values
from estimator.signals.record import BoolArray, FloatArray

SAMPLES_PER_PARAMETER = 10
"""Good samples asked for per parameter; fewer fit the noise as well as the system."""

RELATIVE_RANK = 1e-6
"""Singular value, against the largest, below which delayed copies count as dependent.

Well above rounding (1e-15) and well below the least that the anti-alias filter leaves
of a PRBS, 50 dB down at the upper edge of the band.
"""


def excitation_order(u: FloatArray, highest: int) -> int:
    """Return the order up to ``highest`` to which the input excites persistently."""
    if u.shape[0] < highest:
        return 0
    copies = np.lib.stride_tricks.sliding_window_view(u, highest)
    singular = singular_values(copies)
    return int(np.count_nonzero(singular > RELATIVE_RANK * singular[0])) if singular[0] > 0 else 0


def require_excitation(name: str, u: FloatArray, y: FloatArray, okay: BoolArray, orders: Orders) -> None:
    """Refuse data that can't determine a model of these orders.

    Parameters
    ----------
    name
        The recording, for the message.
    u, y, okay
        Input, output and mask, shape (N,).

    Raises
    ------
    NotExciting
        Naming the parameters that stay undetermined, why, and what to do.
    """
    n = orders.n_parameters
    good = int(np.count_nonzero(okay))
    if good < SAMPLES_PER_PARAMETER * n:
        raise NotExciting(
            f"recording {name}: {good} good samples, expected at least {SAMPLES_PER_PARAMETER * n} for {n} "
            "parameters. Record longer, mask less, or lower the orders.",
            orders.names,
        )
    order = excitation_order(u, n)
    if order < n:
        names = _beyond(order, orders)
        raise NotExciting(
            f"recording {name}: the torque excites {order} parameters, expected {n}; "
            f"{', '.join(names)} can't be determined. Superpose a PRBS on the torque, or lower the orders.",
            names,
        )
    if np.ptp(y[okay]) == 0.0:
        raise NotExciting(
            f"recording {name}: the measured output never changes while the torque does; no parameter can be "
            "determined. Check the sensor and its scale.",
            orders.names,
        )


def _beyond(order: int, orders: Orders) -> tuple[str, ...]:
    """Return the parameters that ``order`` independent copies leave over, numerator served first."""
    nb = min(orders.nb, order - order // 2)
    na = min(orders.na, order - nb)
    a = [f"a_{i}" for i in range(na + 1, orders.na + 1)]
    return (*a, *(f"b_{j}" for j in range(nb + 1, orders.nb + 1)))
