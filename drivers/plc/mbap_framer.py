"""pymodbus's framer for Modbus TCP, which says what it passed over.

An answer whose transaction or unit identifier is not the request's is skipped by pymodbus with a line in its log, and
its user learns that none came (3.16.1). Which ones came stands here, so that the wait can end with the right cause.
"""

from __future__ import annotations

from dataclasses import dataclass

from pymodbus.framer import FramerSocket
from pymodbus.pdu import DecodePDU


@dataclass(frozen=True, slots=True)
class AnswerIds:
    """Identifiers in the MBAP header of an answer (Modbus Messaging on TCP/IP V1.0b, 3.1.3)."""

    transaction: int
    unit: int

    def __str__(self) -> str:
        return f"transaction id {self.transaction}, unit id {self.unit}"


class MbapFramer(FramerSocket):
    """A framer that keeps the identifiers of the answers that came.

    Parameters
    ----------
    decoder
        Makes PDUs of bytes.
    """

    def __init__(self, decoder: DecodePDU) -> None:
        super().__init__(decoder)
        self.got: list[AnswerIds] = []

    def begin(self) -> None:
        """Forget what came: another request is sent."""
        self.got.clear()

    def decode(self, data: bytes) -> tuple[int, int, int, bytes]:
        """Take a frame apart: length, unit, transaction, PDU; length 0 where it is none, or not all of one."""
        length, unit, transaction, pdu = super().decode(data)
        if length:
            self.got.append(AnswerIds(transaction, unit))
        return length, unit, transaction, pdu
