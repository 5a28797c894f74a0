"""The library's remote node, made deaf to SDO answers that are not for the request under way.

``canopen``'s client takes the acknowledgement of any write for that of its own. An answer that comes after
its request was given up (time-out, Ctrl-C) would then confirm another object than the one it belongs to.
"""

from __future__ import annotations

import canopen
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import SdoClient

from drivers.errors import ProtocolViolation

_INITIATE_REQUESTS = (1, 2)
"""Client command specifiers of download and upload initiate (CiA 301, 7.2.4.3); they name the object."""

_NAMING_RESPONSES = (2, 3, 4)
"""Server command specifiers of upload and download initiate, and of abort; they name the object."""

_FRAME_BYTES = 8


class MatchingSdoClient(SdoClient):
    """An SDO client that drops answers about any other object than the one it asked for."""

    def __init__(self, rx_cobid: int, tx_cobid: int, dictionary: ObjectDictionary) -> None:
        super().__init__(rx_cobid, tx_cobid, dictionary)  # type: ignore[no-untyped-call]
        self._multiplexer = b""

    def request_response(self, sdo_request: bytes) -> bytes:
        """Send a request and wait for its answer."""
        if sdo_request[0] >> 5 in _INITIATE_REQUESTS:
            self._multiplexer = bytes(sdo_request[1:4])
        response: bytes = super().request_response(sdo_request)  # type: ignore[no-untyped-call]
        return response

    def on_response(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take an answer, in the receive thread.

        Raises
        ------
        ProtocolViolation
            If it has not 8 bytes.
        """
        if len(data) != _FRAME_BYTES:
            raise ProtocolViolation(
                f"SDO answer 0x{can_id:03X} of {len(data)} bytes, expected {_FRAME_BYTES}. "
                "Check the device's firmware version."
            )
        if data[0] >> 5 in _NAMING_RESPONSES and bytes(data[1:4]) != self._multiplexer:
            return
        super().on_response(can_id, data, timestamp)  # type: ignore[no-untyped-call]


class SdoNode(canopen.RemoteNode):
    """A remote node whose SDO client is a `MatchingSdoClient`."""

    def add_sdo(self, rx_cobid: int, tx_cobid: int) -> MatchingSdoClient:
        """Add an SDO channel; the library calls this once, before the node has a network."""
        client = MatchingSdoClient(rx_cobid, tx_cobid, self.object_dictionary)
        self.sdo_channels.append(client)
        return client
