"""Get back to the drives after the bus was lost, as a step of its own: nothing here is done behind a run's back.

A run ends with the bus. What the drives did meanwhile is theirs to say: each must answer and confirm that it is
disarmed before anything else is asked of it, and is configured anew before it is armed.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

from drivers.canopen.can_link import CanLink
from drivers.errors import BusDown, DriverError
from drivers.inverter.inverter import Inverter
from drivers.inverter.settings import InverterSettings

RETRY_S = 0.2
"""Between two tries: what an adapter needs to be found again."""


def reconnect(
    url: str, settings: Sequence[InverterSettings], patience_s: float
) -> tuple[CanLink, tuple[Inverter, ...]]:
    """Open the bus anew and see every drive disarmed."""
    link = _opened(url, patience_s)
    try:
        inverters = tuple(Inverter(link, each) for each in settings)
        for inverter in inverters:
            inverter.disarm()
        link.raise_if_failed()
    except DriverError:
        link.close()
        raise
    return link, inverters


def _opened(url: str, patience_s: float) -> CanLink:
    deadline_s = time.monotonic() + patience_s
    while True:
        try:
            return CanLink.open(url)
        except BusDown:
            if time.monotonic() >= deadline_s:
                raise
        time.sleep(RETRY_S)
