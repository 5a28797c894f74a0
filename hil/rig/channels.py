"""The rig's further channels, read once per cycle: from the inverters' TPDOs and from registers of the PLC.

A value counts only in the cycle it was read in. One that does not arrive in time is NaN there, and no run ends for it:
no torque depends on a channel.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Future

from drivers.errors import DriverError
from drivers.inverter.inverter import Inverter
from drivers.plc.plc import Plc
from drivers.plc.register_map import RegisterMap
from hil.config.channel_table import ChannelTable
from hil.rig.plc_loop import PlcLoop


class Channels:
    """What is read in addition to torque and speed."""

    __slots__ = ("_factors", "_from_plc", "_inverters", "_loop", "_plc", "_poll", "_registers", "_sources")

    def __init__(
        self,
        tables: Sequence[ChannelTable],
        register_map: RegisterMap,
        inverters: Mapping[str, Inverter],
        loop: PlcLoop,
        plc: Plc,
    ) -> None:
        self._sources = [table.inverter for table in tables]
        self._factors = [table.factor(register_map) for table in tables]
        self._inverters = {name: each for name, each in inverters.items() if name in self._sources}
        self._registers = [table.register_name for table in tables if table.register_name is not None]
        self._loop, self._plc = loop, plc
        self._poll: Future[tuple[float, ...]] | None = None

    def read(self, sync_ns: int, patience_s: float) -> tuple[float, ...]:
        """Read all channels of the present cycle."""
        if not self._sources:
            return ()
        until = time.monotonic() + patience_s
        asked = self._ask()
        counts = {
            name: iter(inverter.await_channels(sync_ns, max(until - time.monotonic(), 0.0)))
            for name, inverter in self._inverters.items()
        }
        registers = iter(self._answer(max(until - time.monotonic(), 0.0)) if asked else self._missing)
        values = (next(registers if source is None else counts[source]) for source in self._sources)
        return tuple(
            math.nan if value is None else value * factor for value, factor in zip(values, self._factors, strict=True)
        )

    @property
    def _missing(self) -> tuple[float, ...]:
        return (math.nan,) * len(self._registers)

    def _ask(self) -> bool:
        """Ask the PLC, unless it still owes an answer to an earlier cycle; tell whether it was asked."""
        if self._poll is not None and self._poll.done():  # of an earlier cycle: it counts for none
            self._poll = None
        if self._poll is not None or not self._registers:
            return False
        self._poll = self._loop.start(self._plc.read_channels(self._registers))
        return True

    def _answer(self, patience_s: float) -> tuple[float, ...]:
        """Wait for what the PLC was asked in this cycle; a PLC that fails is for `hil.rig.plc_watch` to judge."""
        if self._poll is None:
            return self._missing
        try:
            values = self._poll.result(patience_s)
        except TimeoutError:
            return self._missing
        except DriverError:
            values = self._missing
        self._poll = None
        return values
