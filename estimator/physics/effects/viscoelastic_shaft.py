"""A shaft that relaxes: rubber in a coupling is a spring in series with a damper, next to the shaft's own spring."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.compiled import compiled
from estimator.physics.driveline import Driveline, Motion, natural_frequencies_rad_s
from estimator.physics.effect import (
    WITH_SHAFT,
    Effect,
    EffectParameter,
    Element,
    Span,
    Start,
    long_enough,
)
from estimator.signals.record import Record


@compiled
def relaxing_rate(torque: float, rate: float, stiffness: float, fastest: float, relaxation_s: float) -> float:
    """Return how fast the branch's torque changes [Nm/s], at a rate of the twist [rad/s].

    One that relaxes within a step of the integration is held to the ``fastest`` decay [1/s] the step can follow.
    """
    return (stiffness * relaxation_s * rate - torque) * min(1.0 / relaxation_s, fastest)


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a tenth of the shaft's stiffness, and the time in which the line swings by a radian."""
    return (0.1, 1.0 / float(natural_frequencies_rad_s(model.values())[0]))


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return branches that relax faster than the line swings, with it, and slower."""
    return [(3.0, time) for time in (0.3, 1.0, 3.0)]


def described(
    model: Driveline, values: Mapping[str, float], line: Mapping[str, float]
) -> Mapping[str, tuple[Span, ...]]:
    """Return the stiffness from slow to fast, and the damping with and without the branch."""
    stiffness = line["k"] * values["branch_share"]
    return {
        "k": ((line["k"], line["k"] + stiffness),),
        "c": ((line["c"], line["c"] + stiffness * values["relaxation_s"]),),
    }


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return (
        f"the shaft is stiffer when twisted fast, by {values['branch_share']:.1%}, and relaxes "
        f"with a time constant of {1e3 * values['relaxation_s']:.3g} ms"
    )


EFFECT = Effect(
    name="viscoelastic_shaft",
    element=Element.SHAFT,
    title="relaxation of the shaft",
    law="T_S = k twist + c r + T_r, dT_r/dt = n k r - T_r / tau, r = d twist/dt",
    source="the standard linear solid (Zener): Lakes, Viscoelastic Materials, Cambridge 2009, ch. 2",
    excited_by="PRBS well below and around the line's resonance",
    parameters=(
        EffectParameter("branch_share", "", 0.0, 0.0, 40.0, "stiffness of the branch over the shaft's: n"),
        EffectParameter("relaxation_s", "s", 1.0, 0.05, 20.0, "time in which its torque relaxes: tau"),
    ),
    example={"branch_share": 0.4, "relaxation_s": 0.02},
    structures=WITH_SHAFT,
    resembles=("extra_torsional_mode", "shaft_hysteresis", "stiffness_nonlinearity", "actuator_lag"),
    loosens=frozenset({"k", "c"}),  # the branch stiffens the line and damps it
    scales=scales,
    starts=starts,
    described=described,
    unresolved=long_enough("relaxation_s"),
    sentence=sentence,
    linear=True,
)
