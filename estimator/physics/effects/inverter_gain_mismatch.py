"""One inverter gives more or less torque than its reading says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from estimator.physics.driveline import Driveline, Motion
from estimator.physics.effect import EVERY_LINE, Effect, EffectParameter, Element, Held, Start, Untestable
from estimator.physics.motion import shares_differ
from estimator.signals.record import Record


def scales(model: Driveline, records: Sequence[Record]) -> tuple[float, ...]:
    """Return 1: gains are near it."""
    return (1.0, 1.0)


def starts(model: Driveline, records: Sequence[Record]) -> list[Start]:
    """Return starts in which one inverter is off and the other is right: both at once are a change of scale."""
    return [(0.9, Held(1.0)), (Held(1.0), 0.9)]


def testable(model: Driveline, records: Sequence[Record]) -> Untestable | None:
    """Need two inputs whose ratio changes, or else a wrong gain is a change of all other parameters."""
    if any(record.torque_nm.shape[1] < 2 for record in records):
        return Untestable("there is one torque input only: its gain is that of all other parameters", "cruise")
    if shares_differ(records):
        return None
    return Untestable(
        "both inverters carry the same share all along: a wrong gain of one is a change of all other parameters. "
        "Let the other one carry the PRBS in one recording",
        "cruise",
    )


IN_PROPORTION = ("inertia", "stiffness", "damping", "torque", "quadratic_drag")
"""Dimensions that change with the torque."""


def rescaled(values: Mapping[str, float]) -> Mapping[str, float]:
    """Return what every torque is multiplied by where the other inverter is the wrong one: only their ratio shows."""
    return dict.fromkeys(IN_PROPORTION, 1.0 / (values["gain_m1"] * values["gain_m2"]))


def sentence(values: Mapping[str, float], motion: Motion) -> str:
    """Say what was found, and the other way to tell it."""
    wrong, right = ("m1", "m2") if values["gain_m1"] != 1.0 else ("m2", "m1")
    gain = values[f"gain_{wrong}"]
    return (
        f"the true torque of inverter {wrong} is {gain:.3g} times its reading; or that of {right} is {1.0 / gain:.3g} "
        "times, with every inertia, stiffness and friction scaled by the same: the recordings determine only the ratio"
    )


EFFECT = Effect(
    name="inverter_gain_mismatch",
    element=Element.TORQUE_PATH,
    title="gain of one inverter",
    law="T = g_1 T_M1 + g_2 T_M2, one of them 1",
    source="magnet flux and temperature: Pyrhönen, Jokinen, Hrabovcová, Design of Rotating Electrical Machines, 2014",
    excited_by="tests in which the two inverters share the torque differently",
    parameters=(
        EffectParameter("gain_m1", "", 1.0, 0.3, 3.0, "true torque of inverter M1 over its reading: g_1", True),
        EffectParameter("gain_m2", "", 1.0, 0.3, 3.0, "true torque of inverter M2 over its reading: g_2", True),
    ),
    structures=EVERY_LINE,
    resembles=("torque_derating", "torque_saturation"),
    scales=scales,
    starts=starts,
    testable=testable,
    sentence=sentence,
    rescaled=rescaled,
    linear=True,
)
