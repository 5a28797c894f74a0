"""What is concealed in the rigs of the proof: in the driveline, an inverter's firmware, a sensor, the PLC, the bus."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final


@dataclass(frozen=True, slots=True)
class Concealed:
    """One rig.

    Attributes
    ----------
    where : str
        In words, for the scoreboard.
    effect : str
        In the driveline, its sensor or its torque path: an effect of the truth simulator.
    faults : tuple of str
        In the devices, as ``hil sim --fault`` takes them.
    truth : mapping
        What the faults are to a diagnosis; it replaces entries of the truth.
    refused : str
        Word that must stand in the reason for which the tool refuses to drive; empty where it should drive.
    """

    where: str
    effect: str = "none"
    faults: tuple[str, ...] = ()
    truth: Mapping[str, Any] = field(default_factory=dict)
    refused: str = ""


STALE_SHARE: Final = 0.1

WIRED: Final[Mapping[str, Concealed]] = MappingProxyType(
    {
        "nothing": Concealed("nowhere: nothing is wrong"),
        "backlash": Concealed("the driveline: backlash", "backlash"),
        "dry_friction": Concealed("the driveline: dry friction at the motor", "coulomb_friction_motor"),
        "inverter_gain": Concealed(
            "an inverter's firmware: its torque is not what it reports", "inverter_gain_mismatch"
        ),
        "resolver_error": Concealed("the resolver: an error that goes round with the shaft", "resolver_error"),
        "stale_pdos": Concealed(
            "an inverter's firmware: PDOs that repeat old values",
            faults=(f"m1.stale_share={STALE_SHARE}",),
            truth={
                "effect": "stale_samples",
                "element": ["acquisition"],
                "hidden": {"stale_samples": {"every": 0.0, "share": STALE_SHARE}},
            },
        ),
        "delayed_torque": Concealed("an inverter's torque path: it acts late", "transport_delay"),
        "clutch_closed": Concealed(
            "the PLC: the clutch does not open", faults=("plc.clutch_closes@0",), refused="clutch"
        ),
    }
)
"""By name. A new rig is one entry."""
