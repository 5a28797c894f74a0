"""A challenge on the wire: a specimen behind simulated inverters, sealed before anyone drives it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hil.proof.seal import Seal, seal
from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.specimen import Specimen, Stream, choose_effect, draw_specimen, stream

CONCEALED = (
    "none",
    "coulomb_friction_motor",
    "stribeck_friction",
    "backlash",
    "stiffness_nonlinearity",
    "actuator_lag",
    "transport_delay",
    "road_grade",
)
"""What may sit in the rig of the demo; "none" is as likely as any other."""


@dataclass(frozen=True, slots=True)
class Challenge:
    """A specimen at rest, ready to be driven, the faults of the devices it is driven by, and its seal."""

    specimen: Specimen
    plant: TruthDriveline
    faults: tuple[str, ...]
    seal: Seal


def draw_challenge(seed: int, effect: str | None = None, faults: Sequence[str] = ()) -> Challenge:
    """Draw a challenge.

    Parameters
    ----------
    seed
        What everything is drawn from, 0 or more.
    effect
        The effect to conceal in the driveline; None draws one of `CONCEALED`.
    faults
        What is wrong with inverters, PLC and bus, as ``hil sim --fault`` takes it.

    Raises
    ------
    UsageError
        If the effect is not registered.
    """
    name = choose_effect(CONCEALED, seed) if effect is None else effect
    specimen = draw_specimen(name, seed)
    physics = specimen.physics(stream(seed, Stream.RECORDING))
    truth = {**specimen.truth(), "faults": list(faults)}
    return Challenge(specimen, TruthDriveline(physics), tuple(faults), seal(truth))


def compile_truth(challenge: Challenge) -> None:
    """Compile the simulator now: its first step would otherwise let a device be late for its SYNC."""
    TruthDriveline(challenge.plant.physics).advance((0.0, 0.0), 1e-3)
