"""An unbalanced, a little oval wheel: a load torque once and twice per wheel turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion, unit
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Start, Untestable
from estimator.physics.motion import goes_round, torque_scale
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a twentieth of the torque in use, 1, and a tenth of the amplitude for twice per turn."""
    return (0.05 * torque_scale(records), 1.0, 0.1, 0.1)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return one start: the problem is linear in amplitude and phase together."""
    return [(0.5, Held(model.gear_ratio or 1.0), 0.0, 0.0)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need the gear ratio, and motion."""
    if model.gear_ratio is None:
        reason = "the model file has no [geometry] gear_ratio: the wheel's angle is unknown"
        return Untestable(reason, "reversal", needs="gear_ratio in the model file's [geometry]")
    if not goes_round(records, model.gear_ratio):
        return Untestable("the load makes less than a whole turn: nothing recurs with its angle", "reversal")
    return None


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return f"the load torque swings by {values['amplitude_nm']:.3g} {unit('torque', motion)} once per wheel turn"


EFFECT = Effect(
    name="load_imbalance",
    element=Element.LOAD,
    title="imbalance of the load",
    law="T_load = T_0 + A (cos(x) + a cos(2 x) + b sin(2 x)), x = phi_M / i + alpha",
    source="Genta, Dynamics of Rotating Systems, Springer 2005",
    excited_by="speeds at which the wheel's turn is felt",
    parameters=(
        EffectParameter("amplitude_nm", "torque", 0.0, 0.0, 100.0, "amplitude A"),
        EffectParameter("motor_turns_per_turn", "", 1.0, 0.01, 100.0, "motor turns per turn of the load: i", True),
        EffectParameter("overtone_in_step", "", 0.0, -5.0, 5.0, "twice per turn, as a share of A: a", True),
        EffectParameter("overtone_across", "", 0.0, -5.0, 5.0, "the same a quarter of its turn on: b", True),
        EffectParameter("phase_rad", "rad", 0.0, -10.0, 10.0, "phase alpha, of each recording", True, True),
    ),
    structures=EVERY_LINE,
    resembles=("torque_ripple", "cardan_second_order", "road_grade"),
    phases={"phase_rad": "amplitude_nm"},
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    waving=True,
)
