"""Objects of one node over SDO: integers in, integers out, every failure one of this package's errors.

``canopen``'s client takes the acknowledgement of any write for that of its own. An answer that comes after its
request was given up (time-out, Ctrl-C) would then confirm another object than the one it belongs to, or give an old
value of the same one. SDO frames have no number. So two things distinguish answers:

- the object they name, their multiplexer, must be the one asked for;
- while a request is unanswered, the next one waits until the node has answered a probe, a read of one of the objects
  that every node has: a server answers in the order of asking (CiA 301, 7.2.4), so nothing older comes behind that
  answer. Where the same object is asked for again, its late answer has one more time-out to come: a gateway may
  change the order.
"""

from __future__ import annotations

import queue
from collections import Counter
from collections.abc import Callable
from typing import Protocol, TypeVar

import canopen
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivers.errors import ConfigMismatch, DeviceTimeout, ProtocolViolation
from drivers.scaling import IntegerType

_UPLOAD = 0x40  # command byte of an upload initiate request

_INITIATE_REQUESTS = (1, 2)
"""Client command specifiers of download and upload initiate (CiA 301, 7.2.4.3); they name the object."""

_ABORT = 4  # command specifier of an abort, of client and server

_NAMING_RESPONSES = (2, 3, _ABORT)
"""Server command specifiers of upload and download initiate, and of abort; they name the object."""

_UNNAMED = bytes(3)  # multiplexer of an abort by a server that does not fill it in; there is no object 0x0000

PROBES = (b"\x00\x10\x00", b"\x01\x10\x00", b"\x18\x10\x01")
"""Multiplexers of objects that every node has (CiA 301): device type, error register, vendor-ID."""

_FRAME_BYTES = 8

MOST_SEGMENTS = 1024
"""Of one transfer, 7 bytes each: the longest texts of a device have some hundred characters."""

_OUT_OF_MEMORY = 0x05040005  # abort code for a transfer that is longer than this client takes

T = TypeVar("T")


class SdoSilence(SdoCommunicationError):
    """The node has not answered in time."""


class MatchingSdoClient(SdoClient):
    """An SDO client that takes an answer for that of the request under way only if it is."""

    def __init__(self, rx_cobid: int, tx_cobid: int, dictionary: ObjectDictionary) -> None:
        super().__init__(rx_cobid, tx_cobid, dictionary)  # type: ignore[no-untyped-call]
        self._multiplexer = b""
        self._in_segments = False
        self._segments = 0
        self._unanswered: Counter[bytes] = Counter()
        self._probes = list(PROBES)

    def request_response(self, sdo_request: bytes) -> bytes:
        """Send a request and wait for its answer."""
        self._in_segments = sdo_request[0] >> 5 not in _INITIATE_REQUESTS
        self._segments = self._segments + 1 if self._in_segments else 0
        if self._segments > MOST_SEGMENTS:
            self.abort(_OUT_OF_MEMORY)
            raise SdoCommunicationError(f"more than {MOST_SEGMENTS} segments came and none was the last")
        if self._in_segments:  # of the object that its initiate has named
            return self._ask(sdo_request)
        multiplexer = bytes(sdo_request[1:4])
        if self._unanswered.total() and not self._settled(multiplexer):
            self._unanswered[multiplexer] += 1
            self.send_request(sdo_request)  # type: ignore[no-untyped-call]
            raise SdoSilence("no answer, and none to the request before")
        self._multiplexer = multiplexer
        return self._ask(sdo_request)

    def abort(self, abort_code: int = 0x08000000) -> None:
        """Give the transfer up; the library leaves out which (CiA 301, 7.2.4.3.17)."""
        self.send_request(bytes((_ABORT << 5,)) + self._multiplexer + abort_code.to_bytes(4, "little"))  # type: ignore[no-untyped-call]

    def _ask(self, request: bytes) -> bytes:
        """Send a request and wait; it counts as unanswered until it is, also where the wait is interrupted."""
        multiplexer = self._multiplexer
        self._unanswered[multiplexer] += 1
        try:
            response: bytes = super().request_response(request)  # type: ignore[no-untyped-call]
        except SdoAbortedError:
            self._answered(multiplexer)
            raise
        except SdoCommunicationError as error:
            raise SdoSilence(str(error)) from error
        self._answered(multiplexer)
        return response

    def _settled(self, wanted: bytes) -> bool:
        """Wait until no answer to an earlier request can come any more; False if the node says nothing at all."""
        probe = next((each for each in self._probes if not self._unanswered[each]), self._probes[0])
        self._probes.remove(probe)
        self._probes.append(probe)  # where all are unanswered, the one that has been longest is the next
        self._multiplexer = probe
        try:
            self._ask(bytes((_UPLOAD,)) + probe + bytes(4))
        except SdoAbortedError:
            pass  # an answer as good as any
        except SdoSilence:
            return False
        if self._unanswered[wanted] > 0:
            self._multiplexer = wanted
            self._drain()
        self._unanswered.clear()
        return True

    def _drain(self) -> None:
        try:
            self.responses.get(timeout=self.RESPONSE_TIMEOUT)
        except queue.Empty:
            pass  # the request, or its answer, was lost on the way

    def _answered(self, multiplexer: bytes) -> None:
        if self._unanswered[multiplexer] > 0:
            self._unanswered[multiplexer] -= 1

    def on_response(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take an answer, in the receive thread."""
        if len(data) != _FRAME_BYTES:
            raise ProtocolViolation(
                f"SDO answer 0x{can_id:03X} of {len(data)} bytes, expected {_FRAME_BYTES}. "
                "Check the device's firmware version."
            )
        service, multiplexer = data[0] >> 5, bytes(data[1:4])
        if service not in _NAMING_RESPONSES:
            expected = self._in_segments
        else:
            expected = multiplexer == self._multiplexer or (service == _ABORT and multiplexer == _UNNAMED)
        if not expected:
            self._answered(multiplexer)  # too late: whoever asked has given up
            return
        super().on_response(can_id, data, timestamp)  # type: ignore[no-untyped-call]


class SdoNode(canopen.RemoteNode):
    """A remote node whose SDO client is a `MatchingSdoClient`."""

    def add_sdo(self, rx_cobid: int, tx_cobid: int) -> MatchingSdoClient:
        """Add an SDO channel; the library calls this once, before the node has a network."""
        client = MatchingSdoClient(rx_cobid, tx_cobid, self.object_dictionary)
        self.sdo_channels.append(client)
        return client


def object_name(index: int, subindex: int = 0) -> str:
    """Name an object in a message: ``0x1018:01``."""
    return f"0x{index:04X}:{subindex:02X}"


class ObjectTypes(Protocol):
    """What the node's data sheet says of its objects; `drivers.datasheet.file.EdsFile` does."""

    @property
    def dictionary(self) -> ObjectDictionary:
        """Every object there is."""
        ...

    def integer_type(self, index: int, subindex: int = 0) -> IntegerType:
        """Return an object's type; `ConfigMismatch` if it has none or is no integer."""
        ...


class SdoChannel:
    """Reads (uploads) and writes (downloads) one node's objects."""

    def __init__(self, node: SdoNode, eds: ObjectTypes, where: str, timeout_s: float) -> None:
        self._client = node.sdo
        self._client.RESPONSE_TIMEOUT = timeout_s
        self._eds = eds
        self._where = where

    def has(self, index: int, subindex: int = 0) -> bool:
        """Whether the EDS lists the object."""
        return self._eds.dictionary.get_variable(index, subindex) is not None

    def upload(self, index: int, subindex: int = 0) -> int:
        """Read an integer from the node's object dictionary, in the type that the EDS gives it."""
        kind = self._eds.integer_type(index, subindex)
        data = self._transfer(index, subindex, lambda: self._client.upload(index, subindex))
        if len(data) != kind.size_bytes:
            raise ProtocolViolation(
                f"{self._where}: object {object_name(index, subindex)} came with {len(data)} bytes, expected "
                f"{kind.size_bytes} ({kind.name} in the EDS). Use the EDS of the drive's firmware version."
            )
        return kind.decode(data)

    def download(self, index: int, subindex: int, value: int) -> None:
        """Write an object; returns when the node has acknowledged it."""
        where = f"{self._where}: object {object_name(index, subindex)}"
        data = self._eds.integer_type(index, subindex).encode(value, where)
        self._transfer(index, subindex, lambda: self._client.download(index, subindex, data))

    def download_confirmed(self, index: int, subindex: int, value: int, ignored: int = 0) -> None:
        """Write an integer and read it back; ConfigMismatch if it differs in bits that are not ``ignored``."""
        self.download(index, subindex, value)
        found = self.upload(index, subindex)
        if (found ^ value) & ~ignored:
            raise ConfigMismatch(
                f"{self._where}: object {object_name(index, subindex)} reads {found} (0x{found:X}) "
                "after writing "
                f"{value} (0x{value:X}), expected what was written. Check whether the drive locks it."
            )

    def _transfer(self, index: int, subindex: int, transfer: Callable[[], T]) -> T:
        name = object_name(index, subindex)
        try:
            return transfer()
        except SdoAbortedError as error:
            raise ConfigMismatch(
                f"{self._where}: object {name} refused with SDO abort ({_in_words(error)}), expected access as "
                "in the EDS. "
                "Compare EDS and drive, and the value with the drive's manual."
            ) from error
        except SdoSilence as error:
            raise DeviceTimeout(
                f"{self._where}: no SDO answer for object {name} within {self._client.RESPONSE_TIMEOUT:g} s. "
                "Check that the drive is powered, its node id and bit rate, and the wiring."
            ) from error
        except SdoCommunicationError as error:
            raise ProtocolViolation(
                f"{self._where}: object {name}: {error}; expected the answer to this request. "
                "Check the device's firmware version, and that no other SDO client talks to this node."
            ) from error


def _in_words(abort: SdoAbortedError) -> str:
    """Say what an abort code means; the library leaves one it does not know to the reader."""
    known = abort.code in SdoAbortedError.CODES
    return str(abort) if known else f"{abort}, a code outside CiA 301: see the drive's manual"
