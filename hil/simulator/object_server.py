"""The object dictionary of a simulated node: ``canopen.LocalNode``, which holds the objects and answers SDO.

A real drive's dictionary is not always its EDS's: objects can be missing, locked, or forget what is written. All of
that is of SDO alone; the node itself reads its objects as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import canopen
from canopen.sdo.exceptions import SdoAbortedError

from drivers.canopen.heartbeat import NMT_COB_ID
from drivers.datasheet.file import EdsFile
from hil.simulator.inverter_settings import InverterFaults

NO_SUCH_OBJECT = 0x06020000
READ_ONLY = 0x06010002
NO_VALUE = 0x060A0023
"""SDO abort codes."""

_DOWNLOAD, _UPLOAD = 1, 2
"""Client command specifiers of the requests that name an object (CiA 301, 7.2.4.3)."""

_ABORT = 0x80

_REQUEST_BYTES = 8


class ObjectServer(canopen.LocalNode):
    """The library's node, with the hooks it offers, but without its NMT slave.

    Parameters
    ----------
    node_id
        Node id.
    eds
        Its objects.
    faults
        Objects it forgets, lacks or locks.
    on_read, on_write
        Called with ``index``, ``subindex``, ``od`` and, for a write, ``data``.
    """

    def __init__(
        self,
        node_id: int,
        eds: EdsFile,
        faults: InverterFaults,
        on_read: Callable[..., int | None],
        on_write: Callable[..., None],
    ) -> None:
        super().__init__(node_id, eds.dictionary)
        self._eds = eds
        self.ignored_writes = faults.ignored_writes
        self._missing = faults.missing_objects
        self._locked = faults.locked_objects
        self._read_callbacks = [on_read]
        self._write_callbacks = [on_write]

    def associate_network(self, network: canopen.Network) -> None:
        """Join a network; what is received comes through `answer`."""
        super().associate_network(network)
        network.unsubscribe(self.sdo.rx_cobid, self.sdo.on_request)
        network.unsubscribe(NMT_COB_ID, self.nmt.on_command)

    def answer(self, request: bytes, t_ns: int) -> None:
        """Answer one SDO request; a shorter frame is none (CiA 301, 7.2.4.3) and is passed over."""
        if len(request) < _REQUEST_BYTES:
            return
        service, index = request[0] >> 5, int.from_bytes(request[1:3], "little")
        if service in (_DOWNLOAD, _UPLOAD) and index in self._missing:
            self._refuse(request, NO_SUCH_OBJECT)
        elif service == _DOWNLOAD and index in self._locked:
            self._refuse(request, READ_ONLY)
        else:
            sdo: Any = self.sdo  # the library's server has no types
            sdo.on_request(self.sdo.rx_cobid, request, t_ns)

    def get_data(self, index: int, subindex: int, check_readable: bool = False) -> bytes:
        """Read an object; a number without a value is 0, as in a drive whose memory was cleared."""
        entry = self._eds.sheet.entry(index, subindex)
        value: bytes
        try:
            value = super().get_data(index, subindex, check_readable)
        except SdoAbortedError as error:
            if error.code != NO_VALUE or entry is None or entry.kind is None or entry.kind.bits is None:
                raise
            value = bytes((entry.kind.bits + 7) // 8)
        return value

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """Write an object, unless it is one that forgets."""
        if index not in self.ignored_writes:
            super().set_data(index, subindex, data, check_writable)

    def _refuse(self, request: bytes, abort_code: int) -> None:
        answer = bytes((_ABORT, *request[1:4])) + abort_code.to_bytes(4, "little")
        self.network.send_message(self.sdo.tx_cobid, answer)
