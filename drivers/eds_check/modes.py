"""Rules for what a drive says of itself that a run depends on: its modes of operation, and a SYNC counter."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.datasheet.finding import EdsFinding, Severity
from drivers.eds_check.context import EdsContext, at_key
from drivers.inverter.cia402 import TorqueMode
from drivers.inverter.drive_settings import NODES, SYNC_COUNTER_OVERFLOW

SUPPORTED_MODES = 0x6502

_TORQUE_MODES = TorqueMode.PROFILE_TORQUE.support_bit | TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE.support_bit


def check_modes(context: EdsContext) -> Iterator[EdsFinding]:
    """Check that the drive has a torque mode, as far as the file says, and takes a SYNC without a counter."""
    yield from _torque_mode(context)
    yield from _sync_counter(context)


def _torque_mode(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(SUPPORTED_MODES)
    if entry is None:
        return
    values = {entry.value(node_id) for node_id in NODES}  # one, unless by some mistake it follows from the node id
    if any(value and not value & _TORQUE_MODES for value in values):  # blank and 0 say nothing: the drive is asked
        expected = f"a torque mode among the supported ones: {' or '.join(mode.title for mode in TorqueMode)}"
        advice = "Look into the drive's manual; a drive without one can't be used."
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "none in", advice)


def _sync_counter(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(SYNC_COUNTER_OVERFLOW)
    if entry is None or not entry.value(context.node_id):
        return
    fixed = not entry.settable
    expected = "0: a SYNC without a counter, as the host sends it"
    advice = "The drive would take no SYNC." if fixed else "It is set to 0 when the drive is configured."
    yield at_key(Severity.ERROR if fixed else Severity.WARNING, entry.section, entry.value_key, expected, "", advice)
