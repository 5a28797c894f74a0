"""A simulated inverter on the bus: object dictionary, NMT slave, heartbeat, EMCY and PDOs of one node.

``canopen.LocalNode`` holds the objects and answers SDO. NMT is done here, for the library's slave sends no
boot-up message after a reset and its heartbeat timer outlives the bus. PDOs follow the configured mapping.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import canopen
from canopen.sdo.exceptions import SdoAbortedError

from drivers.can_link import CanLink, FrameCallback
from drivers.eds_file import EdsFile
from drivers.emcy import EMCY_COB_ID, Emergency
from drivers.errors import ProtocolViolation
from drivers.heartbeat import HEARTBEAT_COB_ID, NMT_COB_ID, HeartbeatProducer, NmtCommand, NmtState
from drivers.pdo_map import PdoCodec
from hil.simulator.heartbeat_consumer import HeartbeatConsumer
from hil.simulator.inverter_device import PARAMETERS, InverterDevice, ObjectRefused
from hil.simulator.inverter_settings import SimulatedInverter
from hil.simulator.pdo_objects import PdoObjects

_SDO_REQUEST_COB_ID = 0x600
_CONSUMER_HEARTBEAT_TIME = (0x1016, 1)
_PRODUCER_HEARTBEAT_TIME = 0x1017
_PDO_LENGTH_ERROR = 0x8210

_NMT_COMMANDS = {bytes((command,)): command for command in NmtCommand}


class _ObjectServer(canopen.LocalNode):
    """The library's node, with the hooks it offers, but without its NMT slave.

    Parameters
    ----------
    node_id
        Node id.
    eds
        Its objects.
    ignored_writes
        Objects whose writes are acknowledged and forgotten.
    on_read, on_write
        Called with ``index``, ``subindex`` and, for a write, ``data``.
    """

    def __init__(
        self,
        node_id: int,
        eds: EdsFile,
        ignored_writes: frozenset[int],
        on_read: Callable[..., int | None],
        on_write: Callable[..., None],
    ) -> None:
        super().__init__(node_id, eds.dictionary)
        self._ignored_writes = ignored_writes
        self._read_callbacks = [on_read]
        self._write_callbacks = [on_write]

    def associate_network(self, network: canopen.Network) -> None:
        super().associate_network(network)
        network.unsubscribe(self.sdo.rx_cobid, self.sdo.on_request)
        network.unsubscribe(NMT_COB_ID, self.nmt.on_command)

    def answer(self, request: bytes, t_ns: int) -> None:
        """Answer one SDO request."""
        sdo: Any = self.sdo  # the library's server has no types
        sdo.on_request(self.sdo.rx_cobid, request, t_ns)

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        if index not in self._ignored_writes:
            super().set_data(index, subindex, data, check_writable)


class InverterNode:
    """One simulated inverter on a link.

    Parameters
    ----------
    link
        The simulated rig's end of the bus.
    settings
        What the inverter is.
    seed
        Of its reading noise.
    """

    def __init__(self, link: CanLink, settings: SimulatedInverter, seed: int) -> None:
        self._link = link
        self._node_id = settings.node_id
        self._ignored_writes = settings.faults.ignored_writes
        self._eds = EdsFile(settings.eds_path, settings.node_id)
        defaults = {index: self._eds.default(index) for index in (*PARAMETERS, 0x60A9)}
        self._device = InverterDevice(settings, defaults, seed)
        self._server = self._serve_objects()
        self._pdo_objects = PdoObjects(self._eds, self._value)
        self._producer: HeartbeatProducer | None = None
        self._rpdos: dict[int, PdoCodec] = {}
        self._tpdos: tuple[PdoCodec, ...] = ()
        self._pending: dict[int, bytes] = {}
        self._heard: set[int] = set()
        self._syncs = 0
        self._state = NmtState.INITIALISING
        self._host = HeartbeatConsumer()
        link.subscribe(_SDO_REQUEST_COB_ID + self._node_id, self._on_sdo_request)
        link.subscribe(NMT_COB_ID, self._on_nmt)
        self._boot()

    @property
    def torque_nm(self) -> float:
        """Torque in effect now [Nm]."""
        return self._device.torque_nm

    def step(self, true_speed_rad_s: float, period_s: float) -> None:
        """Take one SYNC: put the RPDOs received since the last into effect, sample speed and torque.

        Parameters
        ----------
        true_speed_rad_s
            Motor speed now [rad/s].
        period_s
            Time until the next SYNC [s].
        """
        self._syncs += 1
        pending, self._pending = self._pending, {}
        for cob_id, data in pending.items():
            self._put_into_effect(self._rpdos[cob_id], data)
        self._device.step(true_speed_rad_s, period_s)
        if self._device.hung:
            self._stop_heartbeat()
        else:
            self._send_emergencies()

    def look_for_host(self, now_ns: int) -> None:
        """Leave OPERATIONAL, without torque, if the host's heartbeat is lost at ``now_ns``."""
        if self._state is NmtState.OPERATIONAL and self._host.lost(now_ns):
            self._device.lose_bus()
            self._pending.clear()
            self._state = NmtState.PRE_OPERATIONAL

    def send_feedback(self) -> None:
        """Send the TPDOs that are due at this SYNC, with the values `step` sampled."""
        if self._device.hung or self._state is not NmtState.OPERATIONAL:
            return
        for tpdo in self._tpdos:
            if self._syncs % tpdo.layout.transmission_type == 0:
                values = tuple(self._value(mapped.index, mapped.subindex) for mapped in tpdo.layout.objects)
                self._link.send(tpdo.layout.cob_id, tpdo.pack(values))

    def close(self) -> None:
        """End the heartbeat; the link is its owner's to close."""
        self._stop_heartbeat()

    def _serve_objects(self) -> _ObjectServer:
        server = _ObjectServer(self._node_id, self._eds, self._ignored_writes, self._on_read, self._on_write)
        self._link.network.add_node(server)
        return server

    def _boot(self) -> None:
        if not self._device.hung:
            self._link.send(HEARTBEAT_COB_ID + self._node_id, bytes((NmtState.INITIALISING,)))
            self._state = NmtState.PRE_OPERATIONAL
            self._send_emergencies()

    def _on_nmt(self, data: bytes, t_ns: int) -> None:
        command = _NMT_COMMANDS.get(data[:1])
        if self._device.hung or command is None or data[1:] not in (b"\0", bytes((self._node_id,))):
            return
        if command is NmtCommand.START:
            self._state = NmtState.OPERATIONAL
            self._start_pdos()
            return
        self._device.lose_bus()
        self._pending.clear()
        if command is NmtCommand.STOP:
            self._state = NmtState.STOPPED
        elif command is NmtCommand.ENTER_PRE_OPERATIONAL:
            self._state = NmtState.PRE_OPERATIONAL
        else:
            self._restart()

    def _restart(self) -> None:
        self._stop_heartbeat()
        self._server.data_store.clear()
        self._device.reset()
        self._host = HeartbeatConsumer()
        self._boot()

    def _start_pdos(self) -> None:
        self._tpdos = self._pdo_objects.tpdos()
        self._rpdos = {rpdo.layout.cob_id: rpdo for rpdo in self._pdo_objects.rpdos()}
        for cob_id in self._rpdos:
            self._hear(cob_id, partial(self._on_rpdo, cob_id))

    def _hear(self, cob_id: int, callback: FrameCallback) -> None:
        if cob_id not in self._heard:
            self._link.subscribe(cob_id, callback)
            self._heard.add(cob_id)

    def _on_heartbeat(self, data: bytes, t_ns: int) -> None:
        self._host.beat(t_ns)

    def _on_rpdo(self, cob_id: int, data: bytes, t_ns: int) -> None:
        if self._state is NmtState.OPERATIONAL and cob_id in self._rpdos:
            self._pending[cob_id] = data

    def _put_into_effect(self, rpdo: PdoCodec, data: bytes) -> None:
        try:
            values = rpdo.unpack(data)
        except ProtocolViolation:  # CiA 301, 7.2.2.6: it is not processed, the error goes out as EMCY
            self._send_emergency(Emergency(_PDO_LENGTH_ERROR, 0, bytes(5)))
            return
        for mapped, value in zip(rpdo.layout.objects, values, strict=True):
            if mapped.index not in self._ignored_writes:
                self._device.write(mapped.index, value)

    def _on_sdo_request(self, data: bytes, t_ns: int) -> None:
        self.look_for_host(t_ns)
        if not self._device.hung and self._state is not NmtState.STOPPED:
            self._server.answer(data, t_ns)
            self._send_emergencies()

    def _on_read(self, *, index: int, subindex: int, od: Any) -> int | None:
        return self._device.read(index, subindex)

    def _on_write(self, *, index: int, subindex: int, od: Any, data: bytes) -> None:
        value = self._eds.integer_type(index, subindex).decode(data)
        try:
            self._pdo_objects.check_write(index, subindex, value)
            self._device.write(index, value)
        except ObjectRefused as refusal:
            raise SdoAbortedError(refusal.abort_code) from refusal
        if index == _PRODUCER_HEARTBEAT_TIME:
            self._start_heartbeat(value / 1000.0)
        elif (index, subindex) == _CONSUMER_HEARTBEAT_TIME:
            self._host = HeartbeatConsumer.from_object(value)
            self._hear(self._host.cob_id, self._on_heartbeat)

    def _value(self, index: int, subindex: int) -> int:
        value = self._device.read(index, subindex)
        if value is not None:
            return value
        return self._eds.integer_type(index, subindex).decode(self._server.get_data(index, subindex))

    def _start_heartbeat(self, period_s: float) -> None:
        self._stop_heartbeat()
        if period_s > 0.0:
            self._producer = HeartbeatProducer(self._link.send, self._node_id, period_s, lambda: self._state)

    def _stop_heartbeat(self) -> None:
        if self._producer is not None:
            self._producer.stop()
            self._producer = None

    def _send_emergencies(self) -> None:
        for emergency in self._device.take_emergencies():
            self._send_emergency(emergency)

    def _send_emergency(self, emergency: Emergency) -> None:
        self._link.send(EMCY_COB_ID + self._node_id, emergency.encode())
