"""What the host knows of an inverter before it talks to it, and what of its lacks somebody has accepted by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from drivers.canopen.heartbeat import HOST_NODE_ID
from drivers.capability.carrier import ObjectId
from drivers.capability.speed_unit import SpeedUnit
from drivers.inverter.cia402 import TorqueMode

PLACEHOLDERS: Final = ("NAME", "REASON")
"""Of name and reason, in a line to be filled in."""


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Who accepted what a drive lacks, and why.

    Attributes
    ----------
    by
        A person's name.
    why
        What stops the torque instead, or why it does not have to.
    """

    by: str
    why: str

    @property
    def is_by_a_person(self) -> bool:
        """Whether somebody filled in name and reason: a line that was only pasted is nobody's acceptance."""
        return _is_filled_in(self.by) and _is_filled_in(self.why)

    def __str__(self) -> str:
        return f"accepted by {self.by}: {self.why}"


def acceptance_line(name: str) -> str:
    """Write the line of the rig file that accepts what is missing, to be filled in."""
    by, why = PLACEHOLDERS
    return f'accepted.{name} = {{ by = "{by}", why = "{why}" }}'


def _is_filled_in(text: str) -> bool:
    """Whether a person has written something: not blank or dots, and not what stands in the line to be filled in."""
    words = text.strip(" .<>\"'").upper()
    return any(map(str.isalnum, words)) and words not in PLACEHOLDERS


@dataclass(frozen=True, slots=True)
class InverterSettings:
    """One inverter as the rig file has it.

    Attributes
    ----------
    name
        Name in messages, such as ``m1``.
    node_id
        CANopen node id, 1 to 127.
    rated_torque_nm
        Motor rated torque; object 0x6076 must agree [Nm].
    torque_limit_nm
        Greatest torque that will be commanded; object 0x6072 must allow it [Nm].
    mode
        Mode of operation to run in.
    eds_path
        The drive's EDS; None for the one that is shipped.
    vendor_id, product_code
        Identity expected in object 0x1018; None for the EDS's.
    serial_number
        Of the drive behind this node id, 0x1018:04; None where it is not compared.
    heartbeat_ms
        Heartbeat period of the drive [ms].
    host_node_id
        Node id of the host's own heartbeat, 1 to 127.
    host_timeout_ms
        Without the host's heartbeat for so long the drive takes the host for dead [ms].
    follow_bit
        Whether the drive says in bit 12 of its statusword that it follows the target torque (mode 10 only).
    rpdo_deadline_ms
        Without an RPDO for so long the drive takes the host for dead [ms].
    option_codes
        Option codes by object, 0x6007 and 0x605A to 0x605E, where not the EDS's.
    torque_slope_nm_per_s
        Torque slope of profile torque mode, object 0x6087; None for the drive's own [Nm/s].
    speed_unit
        Unit of 0x606C; None for the drive's own.
    rated_torque_unit_nm
        What one count of 0x6076 is; CiA 402 has a thousandth [Nm].
    accepted
        What the drive lacks and somebody has accepted, by name.
    channels
        Further objects to be recorded in each cycle.
    sdo_timeout_s
        Longest wait for an SDO answer [s].
    mode_timeout_s
        Longest wait for the mode of operation to be shown in 0x6061 [s].
    state_timeout_s
        Longest wait for a change of power state or NMT state [s].
    speed_limit_rad_s
        Fastest speed at which there may be a torque; infinite where nothing limits it [rad/s].
    """

    name: str
    node_id: int
    rated_torque_nm: float
    torque_limit_nm: float
    mode: TorqueMode = TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE
    eds_path: Path | None = None
    vendor_id: int | None = None
    product_code: int | None = None
    serial_number: int | None = None
    heartbeat_ms: int = 100
    host_node_id: int = HOST_NODE_ID
    host_timeout_ms: int = 150
    follow_bit: bool = True
    rpdo_deadline_ms: int = 150
    option_codes: Mapping[int, int] = field(default_factory=dict)
    torque_slope_nm_per_s: float | None = None
    speed_unit: SpeedUnit | None = None
    rated_torque_unit_nm: float = 1e-3
    accepted: Mapping[str, Acceptance] = field(default_factory=dict)
    channels: tuple[ObjectId, ...] = ()
    sdo_timeout_s: float = 0.5
    mode_timeout_s: float = 2.0
    state_timeout_s: float = 2.0
    speed_limit_rad_s: float = math.inf

    @property
    def heartbeat_timeout_ms(self) -> int:
        """Without a heartbeat for so long the drive counts as lost [ms].

        Five periods, for a heartbeat has the bus's lowest priority; not below 0.5 s, for the host is no real-time
        system, and torque without answers ends sooner by the age of the feedback.
        """
        return min(max(5 * self.heartbeat_ms, 500), 0xFFFF)

    @property
    def host_heartbeat_s(self) -> float:
        """Period of the host's heartbeat: a fifth of what the drive waits for it [s]."""
        return self.host_timeout_ms / 5 / 1000.0

    @property
    def nmt_timeout_s(self) -> float:
        """Longest wait for an NMT state: two heartbeats at least, for it is the heartbeat that reports it [s]."""
        return max(self.state_timeout_s, 2.0 * self.heartbeat_ms / 1000.0)

    @property
    def where(self) -> str:
        """The device's name in messages."""
        return f"inverter {self.name} (node {self.node_id})"
