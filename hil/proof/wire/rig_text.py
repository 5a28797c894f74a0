"""The rig file of a sealed rig: the shipped one, with the addresses this one is served at."""

from __future__ import annotations

from typing import Any

import tomlkit

from hil.proof.wire.sealed_process import SealedProcess
from hil.proof.wire.sealed_rig import RIG_FILE


def rig_text(sealed: SealedProcess) -> str:
    """Return the text of the rig file."""
    document: Any = tomlkit.parse(RIG_FILE.read_text(encoding="utf-8"))
    host, _, port = sealed.modbus.rpartition(":")
    document["can"]["url"] = sealed.bus
    document["plc"]["host"], document["plc"]["port"] = host, int(port)
    return tomlkit.dumps(document)
