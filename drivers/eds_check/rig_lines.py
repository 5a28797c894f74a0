"""What the rig file has to say of a drive because its data sheet does not: lines ready to paste, with the reasons."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from drivers.capability.function import Function
from drivers.capability.plan import DrivePlan
from drivers.capability.speed_unit import described_scale, speed_unit_line, unit_in_words
from drivers.inverter.acceptance import acceptance_line
from drivers.inverter.cia402 import TorqueMode
from drivers.inverter.drive_settings import ABORT_CONNECTION, NO_ACTION, PRODUCER_HEARTBEAT
from drivers.inverter.protection import protections
from drivers.inverter.settings import InverterSettings

USUAL_HEARTBEAT_MS = 100


@dataclass(frozen=True, slots=True)
class RigLine:
    """One line under ``[inverters.m1]`` or ``[inverters.m2]``.

    Attributes
    ----------
    text
        The line.
    reason
        Why it has to be there.
    """

    text: str
    reason: str

    @property
    def key(self) -> str:
        """The key it gives a value to."""
        return self.text.partition(" = ")[0]


def rig_lines(plan: DrivePlan) -> tuple[RigLine, ...]:
    """List the lines a drive needs; none if its data sheet says it all."""
    return tuple(_lines(plan))


def usual_mode(plan: DrivePlan) -> TorqueMode:
    """Choose the mode of operation: cyclic synchronous torque, unless the drive has profile torque alone."""
    supported = _supported_modes(plan)
    cyclic, profile = TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE, TorqueMode.PROFILE_TORQUE
    only_profile = supported is not None and not supported & cyclic.support_bit and supported & profile.support_bit
    return profile if only_profile else cyclic


def _supported_modes(plan: DrivePlan) -> int | None:
    """Read supported drive modes from the data sheet; 0 is a place left free."""
    value = plan.sheet.value(0x6502) if plan.has(Function.SUPPORTED_MODES) else None
    return value or None


def _lines(plan: DrivePlan) -> Iterator[RigLine]:
    mode = usual_mode(plan)
    if mode is not TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE:
        yield RigLine(f'mode = "{mode.name.lower()}"', "0x6502 has no other torque mode")
    if described_scale(plan, "data sheet") is None:
        yield RigLine(speed_unit_line(plan), f"what a count of 0x606C is: {unit_in_words(plan)}; see the manual")
    fixed_ms = plan.sheet.value(PRODUCER_HEARTBEAT)
    writable = plan.abilities[Function.HEARTBEAT_PRODUCER].writable(plan.sheet)
    if not writable and fixed_ms is not None and fixed_ms > USUAL_HEARTBEAT_MS:
        yield RigLine(f"heartbeat_ms = {fixed_ms}", "0x1017 can't be written")
    no_action = plan.has(Function.ABORT_CONNECTION) and plan.sheet.value(ABORT_CONNECTION) == NO_ACTION
    codes = {}
    if no_action and plan.abilities[Function.ABORT_CONNECTION].writable(plan.sheet):
        codes = {ABORT_CONNECTION: 2}
        yield RigLine("option_codes.abort_connection = 2", "0x6007 is 0, no action: 2 disables the voltage")
    supported = _supported_modes(plan)
    if supported is not None and not any(supported & each.support_bit for each in TorqueMode):
        reason = f"0x6502 is 0x{supported:08X}, without a torque mode: the mode display 0x6061 alone confirms it"
        yield RigLine(acceptance_line("supported_modes"), reason)
    settings = InverterSettings("m1", plan.sheet.node_id, 1.0, 1.0, option_codes=codes)
    for each in protections(plan, settings):
        if not each.in_order:
            yield RigLine(acceptance_line(each.name), f"not in the data sheet: {each.against}")
