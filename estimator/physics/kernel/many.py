"""Many simulations of one recording in one call: threads do not wait for the interpreter in between."""

from __future__ import annotations

from typing import Any

import numpy as np

from estimator.compiled import compiled
from estimator.lanes import LANES
from estimator.physics.kernel.integration import integrate, with_mode
from estimator.physics.kernel.makes import Masses
from estimator.physics.kernel.side_by_side import go_side_by_side, integrate_side_by_side, kin_together, leading_kin
from estimator.signals.record import FloatArray, IntArray


@compiled
def integrate_each(
    masses: Masses,
    own: tuple[Any, ...],
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    start_s: float,
    torque: FloatArray,
    load: FloatArray,
    fed_by: IntArray,
    loaded_by: IntArray,
    angle: FloatArray,
    p: FloatArray,
    state: FloatArray,
    outputs: IntArray,
    sensor: bool,
    out: FloatArray,
    slopes: FloatArray,
    alike: IntArray,
) -> None:
    """Do what ``integrate`` does for every row of ``p``, ``state``, ``out`` and ``slopes``.

    Of shape (K, C, N) is ``out``: N samples of C outputs. Row i is driven by the rows ``fed_by[i]`` of ``torque`` and
    ``loaded_by[i]`` of ``load``. It is as row 0 before sample ``alike[i]`` and is simulated from about there on;
    ``alike[0]`` is the number of samples. Rows that are kin go side by side where they can, and leave their states as
    they were.
    """
    given = (sample_time_s, substeps, sign_width)
    apart = not np.any(alike[1:])
    order = kin_together(p) if apart else 1 + np.argsort(alike[1:])
    samples, reached, i = torque.shape[1], 0, 0
    while i < order.size:
        rows = order[i : i + LANES]
        rows = rows[: leading_kin(p, rows)]
        together = len(own) == 0 and slopes.shape[2] == 0 and go_side_by_side(masses, p, rows)
        if not together:
            rows = rows[:1]
        i += rows.size
        common = 0 if apart else alike[rows[0]]
        if common > reached:
            known = (torque[fed_by[0]], load[loaded_by[0]], angle, p[0], state[0])
            integrate(masses, own, *given, reached, common, start_s, *known, outputs, sensor, out[0], slopes[0])
            reached = common
        if reached > 0:
            for row in rows:
                state[row] = state[0]
                out[row, :, :reached] = out[0, :, :reached]
                slopes[row, :, : reached + 1] = slopes[0, :, : reached + 1]
        if together:
            finest = substeps
            for row in rows:
                finest = max(finest, with_mode(substeps, sample_time_s, p[row]))
            them = (torque, load, fed_by, loaded_by, angle, p, state)
            integrate_side_by_side(
                masses, sample_time_s, finest, sign_width, reached, start_s, rows, *them, outputs, sensor, out
            )
        else:
            row = rows[0]
            it = (torque[fed_by[row]], load[loaded_by[row]], angle, p[row], state[row])
            integrate(masses, own, *given, reached, samples, start_s, *it, outputs, sensor, out[row], slopes[row])
    if not apart:
        rest = (torque[fed_by[0]], load[loaded_by[0]], angle, p[0], state[0])
        integrate(masses, own, *given, reached, samples, start_s, *rest, outputs, sensor, out[0], slopes[0])
