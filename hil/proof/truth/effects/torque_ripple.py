"""Torque that pulsates with the motor angle: slots and magnets, or errors of the current sensors.

Cogging is there without torque, ripple of the currents grows with it. Twice per turn is left out: to torque and
speed it is the Cardan joint's (`cardan_second_order`). Each recording begins at another angle.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, unless_zero
from hil.proof.truth.physics import Physics

ORDERS = (1, 3, 4, 6, 12)
"""Periods per turn: eccentricity, three or four pole pairs, slots; faster ones never meet the shaft's resonance."""

USUAL_TORQUE_NM = 200.0
"""Torque at which both kinds of ripple are alike."""


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    size_nm = log_uniform(rng, 5.0, 40.0)
    cogging = bool(rng.random() < 0.5)
    return {
        "order": float(rng.choice(ORDERS)),
        "ripple_nm": size_nm if cogging else 0.0,
        "ripple_over_torque": 0.0 if cogging else size_nm / USUAL_TORQUE_NM,
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        ripple_nm=sizes["ripple_nm"],
        ripple_share=sizes["ripple_over_torque"],
        ripple_order=sizes["order"],
        ripple_phase_rad=rng.uniform(0.0, 2.0 * np.pi),
    )


EFFECT = HiddenEffect(
    "torque_ripple",
    Place.TORQUE_PATH,
    True,
    _draw,
    _apply,
    fitted={"order": "order", "amplitude_nm": unless_zero("ripple_nm"), "share": unless_zero("ripple_over_torque")},
    unscaled=("order",),
)
