"""The nominal model of a specimen as a model file: all a tool knows of the bus."""

from __future__ import annotations

from hil.proof.truth.bus import NOMINAL_TOLERANCE
from hil.proof.truth.specimen import Specimen

SPEED_AT_THE_LOAD = """[signals]
outputs = [
    { kind = "speed", at = "motor", column = "speed_rad_s" },
    { kind = "speed", at = "load", column = "speed_load_rad_s" },
]
"""


def model_toml(specimen: Specimen, at_the_load: bool = False) -> str:
    """Return the text of the model file; with the speed ``at_the_load`` as a second output where it is recorded."""
    lines = ['schema = "hil.model/1"', 'structure = "two_mass"', "", "[parameters]"]
    for name, value in specimen.nominal.items():
        lines.append(f"{name} = {{ value = {value:.6g}, tolerance = {NOMINAL_TOLERANCE} }}")
    text = "\n".join([*lines, "", "[geometry]", f"gear_ratio = {specimen.bus.gear_ratio}", ""])
    return f"{text}\n{SPEED_AT_THE_LOAD}" if at_the_load else text
