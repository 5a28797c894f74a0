"""The nominal model of a specimen as a model file: all a tool is told of the bus."""

from __future__ import annotations

from hil.proof.truth.bus import NOMINAL_TOLERANCE
from hil.proof.truth.specimen import Specimen


def model_toml(specimen: Specimen) -> str:
    """Return the text of the model file."""
    lines = ['schema = "hil.model/1"', 'structure = "two_mass"', "", "[parameters]"]
    for name, value in specimen.nominal.items():
        lines.append(f"{name} = {{ value = {value:.6g}, tolerance = {NOMINAL_TOLERANCE} }}")
    return "\n".join([*lines, "", "[geometry]", f"gear_ratio = {specimen.bus.gear_ratio}", ""])
