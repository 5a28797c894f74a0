"""The faults of the simulated PLC that can be asked for by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from hil.simulator.fault_kind import Kind
from hil.simulator.plc_device import PlcFaults

PLC_KINDS: Final[Mapping[str, Kind[PlcFaults]]] = MappingProxyType(
    {
        "clutch_closes": Kind(True, lambda faults, when: replace(faults, clutch_closes_at_s=when.at_s)),
        "permissive_withdrawn": Kind(True, lambda faults, when: replace(faults, permissive_withdrawn_at_s=when.at_s)),
        "mode_changes": Kind(True, lambda faults, when: replace(faults, mode_changes_at_s=when.at_s)),
        "hang": Kind(True, lambda faults, when: replace(faults, hangs_at_s=when.at_s)),
        "exception": Kind(True, lambda faults, when: replace(faults, exceptions_at_s=when.at_s)),
        "slow": Kind(True, lambda faults, when: replace(faults, late_at_s=when.at_s)),
        "half_answer": Kind(True, lambda faults, when: replace(faults, half_at_s=when.at_s)),
        "reset": Kind(True, lambda faults, when: replace(faults, resets_at_s=when.at_s)),
        "wrong_unit": Kind(True, lambda faults, when: replace(faults, wrong_unit_at_s=when.at_s)),
        "wrong_transaction": Kind(True, lambda faults, when: replace(faults, wrong_transaction_at_s=when.at_s)),
        "swapped_floats": Kind(False, lambda faults, when: replace(faults, swaps_floats=True)),
        "wrong_width": Kind(True, lambda faults, when: replace(faults, too_few_at_s=when.at_s)),
    }
)
