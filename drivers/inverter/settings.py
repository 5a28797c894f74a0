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

PLACEHOLDERS: Final = ("NAME", "REASON")  # of name and reason, in a line to be filled in


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Who accepted what a drive lacks, and why."""

    by: str  # A person's name
    why: str  # what stops the torque instead, or why it does not have to

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
    """One inverter as the rig file has it."""

    name: str  # name in messages, such as ``m1``
    node_id: int  # CANopen node id, 1 to 127
    rated_torque_nm: float  # motor rated torque
    torque_limit_nm: float  # greatest torque that will be commanded
    mode: TorqueMode = TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE  # mode of operation to run in
    eds_path: Path | None = None  # the drive's EDS; None for the one that is shipped
    vendor_id: int | None = None  # expected in 0x1018:01; None for the EDS's
    product_code: int | None = None  # expected in 0x1018:02; None for the EDS's
    serial_number: int | None = None  # of the drive behind this node id, 0x1018:04; None where it is not compared
    heartbeat_ms: int = 100  # heartbeat period of the drive [ms]
    host_node_id: int = HOST_NODE_ID  # node id of the host's own heartbeat, 1 to 127
    host_timeout_ms: int = 150  # without the host's heartbeat for so long the drive takes the host for dead [ms]
    follow_bit: bool = True  # whether bit 12 of the statusword is to be believed
    rpdo_deadline_ms: int = 150  # without an RPDO for so long the drive takes the host for dead [ms]
    option_codes: Mapping[int, int] = field(default_factory=dict)
    """By object (0x605A to 0x605E, 0x6007): what the drive does when it stops."""
    torque_slope_nm_per_s: float | None = None  # object 0x6087; None leaves the drive's own [Nm/s]
    speed_unit: SpeedUnit | None = None  # unit of 0x606C; None for the drive's own
    rated_torque_unit_nm: float = 1e-3  # what one count of 0x6076 is
    accepted: Mapping[str, Acceptance] = field(default_factory=dict)
    """What the drive lacks and the rig file accepts, by name."""
    channels: tuple[ObjectId, ...] = ()  # further objects to be recorded in each cycle
    sdo_timeout_s: float = 0.5  # longest wait for an SDO answer [s]
    mode_timeout_s: float = 2.0  # longest wait for the mode of operation to be shown in 0x6061 [s]
    state_timeout_s: float = 2.0  # longest wait for a change of power state or NMT state [s]
    speed_limit_rad_s: float = math.inf  # fastest speed at which there may be a torque

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
