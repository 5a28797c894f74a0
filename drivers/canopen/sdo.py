"""Objects of one node over SDO: integers in, integers out, every failure one of this package's errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivers.canopen.sdo_node import SdoNode, SdoSilence
from drivers.errors import ConfigMismatch, DeviceTimeout, ProtocolViolation
from drivers.scaling import IntegerType

T = TypeVar("T")


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
    """Reads (uploads) and writes (downloads) one node's objects.

    Parameters
    ----------
    node
        The node, already on its network.
    eds
        Gives each object its data type.
    where
        Device, for messages.
    timeout_s
        How long to wait for each answer [s].
    """

    def __init__(self, node: SdoNode, eds: ObjectTypes, where: str, timeout_s: float) -> None:
        self._client = node.sdo
        self._client.RESPONSE_TIMEOUT = timeout_s
        self._eds = eds
        self._where = where

    def has(self, index: int, subindex: int = 0) -> bool:
        """Whether the EDS lists the object."""
        return self._eds.dictionary.get_variable(index, subindex) is not None

    def upload(self, index: int, subindex: int = 0) -> int:
        """Read an object."""
        kind = self._eds.integer_type(index, subindex)
        data = self._transfer(index, subindex, lambda: self._client.upload(index, subindex))
        if len(data) != kind.size_bytes:
            raise ProtocolViolation(
                f"{self._where}: object {object_name(index, subindex)} came with {len(data)} bytes, expected "
                f"{kind.size_bytes} ({kind.name} in the EDS). Use the EDS of the drive's firmware version."
            )
        return kind.decode(data)

    def upload_text(self, index: int, subindex: int = 0) -> str:
        """Read a VISIBLE_STRING, such as the device name 0x1008; one longer than 4 bytes comes in segments."""
        data: bytes = self._transfer(index, subindex, lambda: self._client.upload(index, subindex))
        try:
            return data.rstrip(b"\0").decode("ascii")
        except UnicodeDecodeError as error:
            raise ProtocolViolation(
                f"{self._where}: object {object_name(index, subindex)} came with [{data.hex(' ')}], expected a text in "
                "ASCII (VISIBLE_STRING, CiA 301). Check the device's firmware version."
            ) from error

    def download(self, index: int, subindex: int, value: int) -> None:
        """Write an object; returns when the node has acknowledged it."""
        where = f"{self._where}: object {object_name(index, subindex)}"
        data = self._eds.integer_type(index, subindex).encode(value, where)
        self._transfer(index, subindex, lambda: self._client.download(index, subindex, data))

    def download_confirmed(self, index: int, subindex: int, value: int, ignored: int = 0) -> None:
        """Write an object and read it back."""
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
