"""Misbehaving Modbus TCP peers for the driver's tests: a bare TCP server that answers what the test says."""

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

Answer = Callable[[bytes], bytes | None]
"""From a request's frame to the bytes sent back; None drops the connection."""


def frame(request: bytes, pdu: bytes, *, unit: int | None = None, transaction: int | None = None) -> bytes:
    """Wrap an answer's PDU in the MBAP header that belongs to a request."""
    tid = request[:2] if transaction is None else transaction.to_bytes(2, "big")
    unit_id = request[6] if unit is None else unit
    return tid + b"\0\0" + (len(pdu) + 1).to_bytes(2, "big") + bytes([unit_id]) + pdu


def free_port() -> int:
    """A loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@asynccontextmanager
async def peer(answer: Answer) -> AsyncIterator[int]:
    """Serve on a free loopback port for the time of the block; yields the port."""
    writers: list[asyncio.StreamWriter] = []

    async def converse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writers.append(writer)
        while request := await reader.read(260):
            reply = answer(request)
            if reply is None:
                break
            writer.write(reply)
        writer.close()

    server = await asyncio.start_server(converse, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        for writer in writers:
            writer.close()
        await server.wait_closed()
        await asyncio.sleep(0)
