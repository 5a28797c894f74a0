"""The PDOs of an inverter as a run wants them, written over SDO and read back.

Only what differs is written: a drive that has the mapping already, for good or from the run before, keeps it.
"""

from __future__ import annotations

from drivers.canopen.pdo_map import COB_ID_INVALID, COB_ID_NO_RTR, PdoLayout, configuration_writes, read_layout
from drivers.canopen.sdo import SdoChannel
from drivers.capability.carrier import Carrier
from drivers.capability.plan import DrivePlan
from drivers.errors import ConfigMismatch


def set_up_pdos(sdo: SdoChannel, plan: DrivePlan, where: str) -> None:
    """Switch off the PDOs that would disturb, and give those of the plan their layouts."""
    for index in plan.strangers:
        _switch_off(sdo, index)
    for carrier in plan.carriers:
        _write(sdo, carrier)
        _require_layout(sdo, carrier.layout, where)


def _switch_off(sdo: SdoChannel, communication_index: int) -> None:
    present = sdo.upload(communication_index, 1)
    if not present & COB_ID_INVALID:
        sdo.download_confirmed(communication_index, 1, present | COB_ID_INVALID, ignored=COB_ID_NO_RTR)


def _write(sdo: SdoChannel, carrier: Carrier) -> None:
    """Write all but what the drive holds for good, and a mapping that is right."""
    layout = carrier.layout
    maps_it = _maps(sdo, layout)
    for index, subindex, value in configuration_writes(layout, sdo.upload(layout.communication_index, 1)):
        if carrier.written(index, subindex) and not (maps_it and index == layout.mapping_index):
            is_cob_id = (index, subindex) == (layout.communication_index, 1)
            sdo.download_confirmed(index, subindex, value, ignored=COB_ID_NO_RTR if is_cob_id else 0)


def _maps(sdo: SdoChannel, layout: PdoLayout) -> bool:
    try:
        found = read_layout(sdo.upload, layout.communication_index, layout.mapping_index)
    except ConfigMismatch:  # what was never set may be of any kind
        return False
    return found.objects == layout.objects


def _require_layout(sdo: SdoChannel, layout: PdoLayout, where: str) -> None:
    found = read_layout(sdo.upload, layout.communication_index, layout.mapping_index)
    if found != layout:  # what is not written has to be there
        raise ConfigMismatch(
            f"{where}: PDO 0x{layout.communication_index:04X}/0x{layout.mapping_index:04X} has [{found}], "
            f"expected [{layout}], and can't be given it. Use the EDS of the drive's firmware version."
        )
