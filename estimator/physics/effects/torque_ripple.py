"""A torque ripple whose frequency follows the motor's speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Start, Untestable
from estimator.physics.motion import goes_round, speed_sweeps, torque_scale
from estimator.signals.record import Record

ORDERS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 18, 20, 24, 30, 36, 48)
"""Periods per motor turn that are tried: pole pairs and slots of usual machines, and their small multiples."""


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, by itself and as a share, 1 for the order, a tenth for its overtone."""
    return (0.05 * torque_scale(records), 0.05, 1.0, 0.1, 0.1)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return two starts per order that machines show, one per cause; the order is a whole number and not fitted.

    One whose period the motor does not pass through once is any law of the angle, such as gravity.
    """
    return [
        start
        for order in ORDERS
        if goes_round(records, 1.0 / order)
        for start in (
            (0.5, Held(0.0), Held(float(order)), 0.0, 0.0),
            (Held(0.0), 0.5, Held(float(order)), 0.0, 0.0),
        )
    ]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need the ripple to pass a frequency at which the line answers: a speed that changes much."""
    if not goes_round(records, 1.0 / ORDERS[-1]):
        return Untestable("the motor makes too little of a turn: nothing recurs with its angle", "reversal")
    if any(speed_sweeps(record) for record in records):
        return None
    return Untestable("the speed hardly changes: a ripple away from the resonance does not show", "reversal")


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    torque = unit("torque", motion)
    size = f"{values['amplitude_nm']:.3g} {torque}" if values["amplitude_nm"] else f"{values['share']:.2%} of itself"
    return f"the torque ripples by {size} at {values['order']:.0f} times per motor turn"


EFFECT = Effect(
    name="torque_ripple",
    element=Element.TORQUE_PATH,
    title="torque ripple",
    law="T = T_read (1 + r w(x)) + A w(x), one of r and A zero, w = cos(x) + a cos(2 x) + b sin(2 x), "
    "x = n phi_M + alpha",
    source="cogging and commutation: Jahns, Soong, IEEE Trans. Ind. Electron. 43(2), 1996",
    excited_by="slow speeds at which n times the speed passes the resonance",
    parameters=(
        EffectParameter("amplitude_nm", "torque", 0.0, 0.0, 20.0, "amplitude A, of cogging", True),
        EffectParameter("share", "", 0.0, 0.0, 20.0, "amplitude as a share of the torque: r", True),
        EffectParameter("order", "", 6.0, 1.0, 96.0, "periods per motor turn: n"),
        EffectParameter("overtone_in_step", "", 0.0, -5.0, 5.0, "twice as often, as a share: a", True),
        EffectParameter("overtone_across", "", 0.0, -5.0, 5.0, "the same a quarter of its turn on: b", True),
        EffectParameter("phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha of A, of each recording", True, True),
        EffectParameter("share_phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha of r, of each recording", True, True),
    ),
    structures=EVERY_LINE,
    resembles=("cardan_second_order", "load_imbalance", "resolver_error"),
    phases={"phase_rad": "amplitude_nm", "share_phase_rad": "share"},
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    waving=True,
)
