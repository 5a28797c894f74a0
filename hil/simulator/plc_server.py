"""The simulated PLC on Modbus TCP: pymodbus's asyncio server; the register map says where each value is.

Every request is answered from the device as it is at that moment; the server holds no values of its own. A
write is decoded and put to the device, and refused with an exception code where the device refuses it.

What a client may do, and how an answer can go wrong, is `hil.simulator.plc_session`'s.

`serve_plc` runs in the caller's event loop; `PlcServer` brings a thread with a loop of its own, for callers
that have none. Both report the port they listen on, which the system chooses where port 0 is asked for.
"""

from __future__ import annotations

import asyncio
import logging
from asyncio.trsock import TransportSocket
from collections.abc import AsyncIterator, Sequence
from concurrent.futures import Future
from contextlib import asynccontextmanager
from threading import Thread
from types import TracebackType
from typing import Final, Self

from drivers.errors import BusDown
from drivers.plc.register_map import RegisterMap
from hil.simulator.plc_access import PlcSecurity
from hil.simulator.plc_answers import Answers
from hil.simulator.plc_device import PlcDevice
from hil.simulator.plc_registers import PlcRegisters
from hil.simulator.plc_session import PlcTcpServer

logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # else it logs to standard error by itself


SETTLE_TURNS: Final = 5
"""Turns of the event loop; asyncio takes three from accepting a connection to telling its protocol."""


class ServedPlc:
    """A PLC that is being served: its port, and a way to let it hang."""

    __slots__ = ("_device", "_paused", "port")

    def __init__(self, device: PlcDevice) -> None:
        self.port = 0
        self._device = device
        self._paused = False

    def pause(self) -> None:
        """Keep the connections up and answer nothing: the PLC that hangs."""
        self._paused = True

    def resume(self) -> None:
        """Answer again."""
        self._paused = False

    def answers(self) -> Answers:
        """Tell how the PLC answers now: as its faults say, or not at all while it is paused."""
        return Answers.NOT if self._paused else self._device.answers


@asynccontextmanager
async def serve_plc(
    device: PlcDevice,
    register_map: RegisterMap,
    host: str = "127.0.0.1",
    port: int = 0,
    security: PlcSecurity | None = None,
) -> AsyncIterator[ServedPlc]:
    """Serve a PLC in the running event loop, for the time of the block.

    Parameters
    ----------
    device : PlcDevice
        What is served.
    register_map : RegisterMap
        Where each of its values is.
    host, port
        Address to listen on; the system chooses port 0.
    security : PlcSecurity or None
        Its certificate and what roles may do; None for plain Modbus TCP.

    Yields
    ------
    ServedPlc
        With the port it listens on.

    Raises
    ------
    BusDown
        If the address can't be listened on.
    ConfigMismatch
        If the map has a register that the device knows nothing of, or the files of its security can't be used.
    """
    registers = PlcRegisters(device, register_map)
    served = ServedPlc(device)
    server = PlcTcpServer(registers, host, port, served.answers, security)
    if not await server.listen():
        raise BusDown(
            f"simulated PLC: expected to listen on {host}:{port}, can't. Is another program using the port? "
            "Choose another in [plc] of the rig file, or 0 for a free one."
        )
    sockets: Sequence[TransportSocket] = server.transport.sockets  # type: ignore[attr-defined]
    served.port = sockets[0].getsockname()[1]
    try:
        yield served
    finally:
        await _close(server, sockets)


async def _close(server: PlcTcpServer, sockets: Sequence[TransportSocket]) -> None:
    """Stop listening and drop every connection, also one that is being accepted just now.

    Such a connection would stay open for ever: until asyncio has informed pymodbus of it, closing the server does
    not reach it. So accepting ends first, and what is under way comes to its end before the server closes.
    """
    for listening in sockets:
        asyncio.get_running_loop().remove_reader(listening.fileno())
    await _settle()
    await server.shutdown()  # type: ignore[no-untyped-call]
    await _settle()


async def _settle() -> None:
    for _ in range(SETTLE_TURNS):
        await asyncio.sleep(0)


class PlcServer:
    """A simulated PLC served by a thread of its own; a context manager that starts and closes.

    Parameters
    ----------
    device, register_map, host, port, security
        As for `serve_plc`.
    """

    __slots__ = ("_device", "_host", "_loop", "_map", "_port", "_ready", "_security", "_stop", "_thread")

    def __init__(
        self,
        device: PlcDevice,
        register_map: RegisterMap,
        host: str = "127.0.0.1",
        port: int = 0,
        security: PlcSecurity | None = None,
    ) -> None:
        self._device = device
        self._map = register_map
        self._host = host
        self._port = port
        self._security = security
        self._ready: Future[ServedPlc] = Future()
        self._thread = Thread(target=self._run, name="plc-server", daemon=True)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop: asyncio.Event | None = None

    def __enter__(self) -> Self:
        """Start; see `start`."""
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        self.close()

    @property
    def host(self) -> str:
        """Host it listens on."""
        return self._host

    @property
    def port(self) -> int:
        """Port it listens on; known once it is started."""
        return self._ready.result().port

    def start(self) -> Self:
        """Start the thread and wait until it listens.

        Raises
        ------
        BusDown, ConfigMismatch
            As for `serve_plc`.
        """
        self._thread.start()
        try:
            self._ready.result()
        except BaseException:
            self._thread.join()
            raise
        return self

    def close(self) -> None:
        """Stop listening, drop the connections and end the thread; safe to call twice."""
        if self._loop is not None and self._stop is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    def pause(self) -> None:
        """Keep the connections up and answer nothing."""
        self._ready.result().pause()

    def resume(self) -> None:
        """Answer again."""
        self._ready.result().resume()

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except BaseException as error:  # carried to the caller of start(), which raises it
            if self._ready.done():
                raise
            self._ready.set_exception(error)

    async def _serve(self) -> None:
        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        async with serve_plc(self._device, self._map, self._host, self._port, self._security) as served:
            self._ready.set_result(served)
            await self._stop.wait()
