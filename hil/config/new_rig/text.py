"""The text of a new rig file: every key with a comment, limits and experiments in proportion to the torque limit.

The proportions are those of ``examples/rig.toml``, where they hold together: with T the torque limit of one inverter,
both share a PRBS of 0.3 T, and 1.25 T of base torque leave it room under every limit, also where one inverter gives
65 % of it. Rates are per second.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Final

from hil.config.new_rig.questions import Answers, Value
from hil.config.rig_file import Rig
from hil.errors import RigFileError
from hil.problems import validate

PARTS_OF_LIMIT: Final = {
    "rate_limit": 5.0,
    "prbs_limit": 0.3,
    "sum_limit": 1.75,
    "prbs_amplitude": 0.3,
    "torque": 1.25,
    "cruise_slew": 2.5,
    "reversal_slew": 5.0,
    "tip_slew": 7.5,
    "swing": 0.625,
    "step": 0.75,
}
"""Torques and rates in parts of one inverter's torque limit."""

TIP_SPEED: Final = 2.0 / 3.0
"""Speed of the tips in parts of the cruise's."""

COMMENTS_AT: Final = 41
"""Column in which comments begin."""

HEXADECIMAL: Final = ("vendor_id", "product_code")


OWN_EDS: Final = "# eds ="
"""Beginning of the template's line that shows how to name an EDS."""

HEARTBEAT: Final = "heartbeat_ms ="
"""Beginning of the template's line of each inverter that what its data sheet makes necessary comes after."""


def rig_text(answers: Answers, file: Path, simulated: bool, drive_lines: Sequence[str] = ()) -> str:
    """Return the file, checked as any rig file is."""
    template = (files("hil.config.new_rig") / "rig.toml").read_text(encoding="utf-8")
    if not simulated:
        template = template.partition("\n[simulation]")[0]
    filled = _filled(answers, file.name)
    lines = [_line(line, filled) for line in template.splitlines()]
    text = "".join(f"{line}\n" for line in (_with_drive(lines, drive_lines) if drive_lines else lines))
    validate(Rig, tomllib.loads(text), file, RigFileError)
    return text


def _with_drive(lines: Sequence[str], drive_lines: Sequence[str]) -> Iterator[str]:
    """Put the drive's own lines into both inverters' tables; a heartbeat of its own takes the place of the usual."""
    own_heartbeat = any(line.startswith(HEARTBEAT) for line in drive_lines)
    for line in lines:
        if not (line.startswith(OWN_EDS) or (own_heartbeat and line.startswith(HEARTBEAT))):
            yield line
        if line.startswith(HEARTBEAT):
            yield from drive_lines


def _filled(answers: Answers, file_name: str) -> dict[str, str]:
    host, _, port = str(answers["plc"]).rpartition(":")
    limit_nm = float(answers["torque_limit_nm"])
    values: dict[str, Value] = {
        **answers,
        "plc_host": host,
        "plc_port": int(port),
        "tip_speed": _rounded(TIP_SPEED * float(answers["speed_rad_s"])),
        **{name: _rounded(part * limit_nm) for name, part in PARTS_OF_LIMIT.items()},
    }
    return {name: _written(name, value) for name, value in values.items()} | {"file_name": file_name}


def _rounded(value: float) -> float:
    """Round to a millionth of the value: products of short numbers stay short."""
    return float(f"{value:.6g}")


def _written(name: str, value: Value) -> str:
    if isinstance(value, str):
        return '"' + re.sub(r'["\\\x00-\x1f\x7f]', lambda match: f"\\u{ord(match[0]):04X}", value) + '"'
    return f"0x{value:X}" if name in HEXADECIMAL else repr(value)


def _line(line: str, filled: dict[str, str]) -> str:
    """Fill in one line of the template and put its comment, if it has one, into its column."""
    key, space, comment = line.partition("  #")
    code = Template(key).substitute(filled)
    if not space:
        return code
    return f"{code.rstrip():<{COMMENTS_AT - 1}} #{Template(comment).substitute(filled)}"
