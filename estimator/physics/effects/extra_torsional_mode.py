"""One more inertia on a spring: a second resonance that the model does not have."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.effect import WITH_SHAFT, Effect, EffectParameter, Element, Start
from estimator.physics.model import DrivelineModel, Motion, natural_frequencies_rad_s, unit
from estimator.signals.record import Record

MOST_DAMPING = 0.15
"""Steel shafts and their rubber couplings stay below this damping ratio of their own."""

LEAST_AMPLIFIED = 2.0
"""By which a resonance amplifies at least, ``1 / (2 zeta)``, whatever damps it."""


def scales(model: DrivelineModel, records: Sequence[Record]) -> tuple[float, ...]:
    """Return a tenth of the motor's inertia, the line's own frequency, a usual damping, and 1."""
    frequency = float(natural_frequencies_rad_s(model.values())[0]) / (2.0 * math.pi)
    return (0.1 * model.parameters["J_M"].value, frequency, 0.05, 1.0)


def starts(model: DrivelineModel, records: Sequence[Record]) -> list[Start]:
    """Return heavy modes far above the first resonance, and light ones below, around and above it, as close as narrow.

    The heavy ones come first: where only what their spring does to the line shows, nothing else tells them apart.
    """
    heavy = [(1.5, ratio, 1.0, 0.95) for ratio in (3.0, 4.0, 5.0, 6.0)]
    return [*heavy, *((0.2, float(ratio), 1.0, 1.0) for ratio in np.geomspace(0.3, 5.0, 24))]


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found."""
    return (
        f"the line has one more torsional mode: {values['inertia_kg_m2']:.3g} {unit('inertia', motion)} on a spring, "
        f"{values['frequency_hz']:.3g} Hz by itself with damping ratio {values['damping_ratio']:.2g}"
    )


def implausible(model: DrivelineModel, records: Sequence[Record], values: Mapping[str, float]) -> str:
    """Object to a branch that is damped so much that it has no resonance of its own to speak of.

    An inertia within the line is damped by the shaft beside it, too: ``c / (2 J_X w)`` comes on top of its own.
    """
    impedance = 4.0 * math.pi * values["inertia_kg_m2"] * values["frequency_hz"]
    most = min(MOST_DAMPING + model.parameters["c"].value / impedance, 0.5 / LEAST_AMPLIFIED)
    if values["damping_ratio"] <= most:
        return ""
    return f"a branch with damping ratio {values['damping_ratio']:.2g} is no mode"


EFFECT = Effect(
    name="extra_torsional_mode",
    element=Element.SHAFT,
    title="one more torsional mode",
    law="J_X dw_X/dt = k_X (phi_M - phi_X) + c_X (w_M - w_X), reacting on the motor; k_X = J_X (2 pi f)^2; "
    "T_S = s k twist + s^2 c d twist/dt, s < 1 where the spring is in the line",
    source="an inertia on a spring beside the main one: Den Hartog, Mechanical Vibrations, 4th ed., 1956",
    excited_by="PRBS that reaches the mode's frequency",
    parameters=(
        EffectParameter("inertia_kg_m2", "inertia", 0.0, 0.0, 50.0, "inertia J_X"),
        EffectParameter("frequency_hz", "Hz", 1.0, 0.05, 8.0, "its frequency with the motor held: f"),
        EffectParameter("damping_ratio", "", 0.05, 0.02, 8.0, "its damping ratio: c_X / (2 sqrt(k_X J_X))"),
        EffectParameter(
            "line_share", "", 1.0, 0.4, 1.0, "share of the twist that the main shaft has: s", True, most=1.0
        ),
    ),
    structures=WITH_SHAFT,
    resembles=("actuator_lag", "stiffness_nonlinearity", "tyre_slip", "speed_filter"),
    equivalent=(),
    contains=(),
    scales=scales,
    starts=starts,
    sentence=sentence,
    decisive=("inertia_kg_m2", "line_share"),
    loosens=frozenset({"k", "c"}),  # a spring in the line softens it by s and lowers its damping by s^2
    loosened_by="line_share",
    implausible=implausible,
    linear=True,
)
