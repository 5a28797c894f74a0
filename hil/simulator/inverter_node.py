"""A simulated inverter on the bus: NMT slave, heartbeat, EMCY, PDOs and supervision of one node.

NMT is done here, for the library's slave sends no boot-up message after a reset and its heartbeat timer outlives
the bus. PDOs follow the configured mapping, identifiers and transmission types, from those of the EDS on. An event is a
changed value; values change at SYNC, for that is when simulated time advances.

It looks for its host (`hil.simulator.stopping`) at every frame it takes and, once it is ordered to watch the host's
heartbeat, by a clock of its own, so that it also notices when nothing comes any more.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from threading import RLock
from typing import Any

import numpy as np
from canopen.sdo.exceptions import SdoAbortedError

from drivers.canopen.can_link import CanLink, FrameCallback
from drivers.canopen.emcy import EMCY_COB_ID, RPDO_TIMEOUT, Emergency
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID, NMT_COB_ID, HeartbeatProducer, NmtCommand, NmtState
from drivers.canopen.pdo_map import COB_ID_INVALID
from drivers.datasheet.file import EdsFile
from drivers.errors import BusDown
from drivers.scaling import IntegerType
from hil.simulator.drive_physics import SimulatedInverter
from hil.simulator.inverter_device import LOST_CONNECTION, InverterDevice, ObjectRefused
from hil.simulator.object_server import (
    ACYCLIC,
    EVENT_DRIVEN,
    INTEGERS,
    ObjectServer,
    PdoFrame,
    PdoObjects,
    fitting,
    power_on_values,
    velocity_scale,
)
from hil.simulator.stopping import HEARTBEAT_ERROR, HeartbeatConsumer, HostWatch, Ticker

_SDO_REQUEST_COB_ID = 0x600
_CONSUMER_HEARTBEAT_TIME = (0x1016, 1)
_PRODUCER_HEARTBEAT_TIME = 0x1017
_ERROR_BEHAVIOUR = (0x1029, 1)
_EMCY_COB_ID = 0x1014
_VELOCITY = 0x606C
_SERIAL_NUMBER = (0x1018, 4)
_PDO_LENGTH_ERROR = 0x8210  # error code of CiA 301
LOOK_EVERY_S = 0.01  # how often it looks for its host where no frame comes [s]
_STALE_STREAM = 1  # of a node's random numbers: the reading noise has one of its own

_NMT_COMMANDS = {bytes((command,)): command for command in NmtCommand}
_CYCLIC = range(1, 241)

_LOST_HOST_STATES = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}
"""Where the error behaviour for communication errors, 0x1029:01, leads from OPERATIONAL; 1 is to stay."""


class InverterNode:
    """One simulated inverter on a link."""

    def __init__(self, link: CanLink, settings: SimulatedInverter, seed: int, real_time: bool = False) -> None:
        self._link = link
        self._node_id = settings.node_id
        self._faults = settings.faults
        self._lock = RLock()  # frames are taken in one thread, the heartbeat is sent by another
        self._eds = EdsFile(settings.eds_path, settings.node_id)
        self._sensors = settings.sensors
        self._serial_number = settings.serial_number
        self._identity = {1: settings.identity[0], 2: settings.identity[1]}
        self._device = InverterDevice(settings, power_on_values(self._eds), velocity_scale(self._eds, settings), seed)
        self._random = np.random.default_rng([seed, settings.node_id, _STALE_STREAM])
        self._server = ObjectServer(self._node_id, self._eds, settings.faults, self._on_read, self._on_write)
        link.network.add_node(self._server)
        self._pdo_objects = PdoObjects(self._eds, self._value)
        self._producer: HeartbeatProducer | None = None
        self._looking: Ticker | None = None
        self._rpdos: dict[int, PdoFrame] = {}
        self._tpdos: tuple[PdoFrame, ...] = ()
        self._pending: dict[int, bytes] = {}
        self._sources: dict[int, tuple[Callable[[], int], ...]] = {}
        self._last_sent: dict[int, bytes] = {}
        self._reported: set[int] = set()
        self._heard: set[int] = set()
        self._syncs = 0
        self._off_bus = False
        self._state = NmtState.INITIALISING
        self._host = HostWatch(real_time)
        link.subscribe(_SDO_REQUEST_COB_ID + self._node_id, self._on_sdo_request)
        link.subscribe(NMT_COB_ID, self._on_nmt)
        self._boot()

    @property
    def torque_nm(self) -> float:
        """Torque in effect now, what the PLC adds included [Nm]."""
        return self._device.torque_nm

    def add_torque(self, torque_nm: float) -> None:
        """Take what another controller adds to the torque reference, past CANopen [Nm]; it holds until the next."""
        self._device.added_nm = torque_nm

    def step(self, t_ns: int, true_speed_rad_s: float, period_s: float) -> None:
        """Take one SYNC: look for the host, put the RPDOs since the last into effect, sample speed and torque."""
        with self._lock:
            self._syncs += 1
            self._host.take_sync(period_s)
            self.look_for_host(t_ns)
            self._meet_faults()
            pending, self._pending = self._pending, {}
            for cob_id, data in pending.items():
                self._put_into_effect(self._rpdos[cob_id], data)
            self._device.step(true_speed_rad_s, period_s)
            if self._device.hung:
                self._stop_heartbeat()
            else:
                self._send_emergencies()

    def look_for_host(self, now_ns: int) -> None:
        """Act on a host that is gone at ``now_ns`` of the wall clock, or whose RPDO is overdue."""
        with self._lock:
            if self._dead:
                return
            if self._host.heartbeat.lost(now_ns):
                self._lose_host(HEARTBEAT_ERROR)
                if self._state is NmtState.OPERATIONAL:
                    self._state = _LOST_HOST_STATES.get(self._error_behaviour(), self._state)
            if self._host.rpdo_missed(now_ns) and self._state is NmtState.OPERATIONAL:
                self._lose_host(RPDO_TIMEOUT)

    def send_feedback(self) -> None:
        """Send the TPDOs that are due at this SYNC, with the values `step` sampled."""
        with self._lock:
            if self._dead or self._state is not NmtState.OPERATIONAL:
                return
            for tpdo in self._tpdos:
                self._send_if_due(tpdo)
            second = self._faults.second_tpdo
            if second is not None and self._syncs >= second.step and self._syncs % second.what == 0:
                self._send_second()

    def close(self) -> None:
        """End heartbeat and watch; the link is its owner's to close."""
        self._stop_heartbeat()
        if self._looking is not None:
            self._looking.stop()

    @property
    def _dead(self) -> bool:
        """Whether it neither hears nor says anything."""
        return self._device.hung or self._off_bus

    def _error_behaviour(self) -> int:
        return 0 if self._eds.sheet.entry(*_ERROR_BEHAVIOUR) is None else self._value(*_ERROR_BEHAVIOUR)

    def _send_if_due(self, tpdo: PdoFrame) -> None:
        kind, cob_id = tpdo.layout.transmission_type, tpdo.layout.cob_id
        if kind == ACYCLIC or kind in EVENT_DRIVEN:
            before = self._last_sent.get(tpdo.layout.communication_index)
            if self._tpdo_data(tpdo) != before:
                self._send(cob_id, self._last_sent[tpdo.layout.communication_index])
        elif kind in _CYCLIC and self._syncs % kind == 0:
            self._send(cob_id, self._tpdo_data(tpdo))

    def _send_second(self) -> None:
        """Send each TPDO with a speed once more, the speed 0: a frame of somebody else with the drive's identifier."""
        for tpdo in self._tpdos:
            mapped = [each.index for each in tpdo.layout.objects]
            if _VELOCITY in mapped:
                values = [read() for read in self._sources[tpdo.layout.communication_index]]
                no_speed = [0 if index == _VELOCITY else value for index, value in zip(mapped, values, strict=True)]
                self._send(tpdo.layout.cob_id, tpdo.pack(no_speed))

    def _meet_faults(self) -> None:
        if self._faults.reset_at_step == self._syncs:
            self._restart()
        if self._faults.bus_off_at_step == self._syncs:
            self._device.lose_connection(LOST_CONNECTION)
            self._pending.clear()
            self._off_bus = True
            self._stop_heartbeat()

    def _tpdo_data(self, tpdo: PdoFrame) -> bytes:
        index = tpdo.layout.communication_index
        if index not in self._last_sent or not self._is_stale():
            self._last_sent[index] = tpdo.pack([read() for read in self._sources[index]])
        return self._last_sent[index]

    def _is_stale(self) -> bool:
        """Whether the next TPDO repeats the one before."""
        if self._faults.stale_share > 0.0 and self._random.random() < self._faults.stale_share:
            return True
        return self._faults.stale_from_step is not None and self._syncs >= self._faults.stale_from_step

    def _boot(self) -> None:
        if not self._device.hung:
            self._send(HEARTBEAT_COB_ID + self._node_id, bytes((NmtState.INITIALISING,)))
            self._state = NmtState.PRE_OPERATIONAL
            if self._eds.sheet.value(_PRODUCER_HEARTBEAT_TIME):
                self._start_heartbeat(self._value(_PRODUCER_HEARTBEAT_TIME, 0) / 1000.0)
            self._send_emergencies()

    def _on_nmt(self, data: bytes, t_ns: int) -> None:
        command = _NMT_COMMANDS.get(data[:1])
        if self._dead or command is None or data[1:] not in (b"\0", bytes((self._node_id,))):
            return
        with self._lock:
            self._take_nmt(command)
            self._send_emergencies()

    def _take_nmt(self, command: NmtCommand) -> None:
        if command is NmtCommand.START:
            self._state = NmtState.OPERATIONAL
            self._start_pdos()
            return
        self._device.lose_connection(LOST_CONNECTION)
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
        self._host.clear()
        self._pending.clear()
        self._boot()

    def _start_pdos(self) -> None:
        self._tpdos = self._pdo_objects.tpdos()
        self._sources = {
            tpdo.layout.communication_index: tuple(
                self._source(each.index, each.subindex) for each in tpdo.layout.objects
            )
            for tpdo in self._tpdos
        }
        self._rpdos = {rpdo.layout.cob_id: rpdo for rpdo in self._pdo_objects.rpdos()}
        self._host.watch_rpdos(
            {cob_id: self._pdo_objects.deadline_ms(rpdo.layout) for cob_id, rpdo in self._rpdos.items()}
        )
        for cob_id in self._rpdos:
            self._hear(cob_id, partial(self._on_rpdo, cob_id))
        self._last_sent.clear()
        for tpdo in self._tpdos:
            if tpdo.layout.transmission_type in EVENT_DRIVEN:
                self._send_if_due(tpdo)

    def _hear(self, cob_id: int, callback: FrameCallback) -> None:
        if cob_id not in self._heard:
            self._link.subscribe(cob_id, callback)
            self._heard.add(cob_id)

    def _on_heartbeat(self, data: bytes, t_ns: int) -> None:
        with self._lock:
            if not self._dead:
                self._host.heartbeat.beat(t_ns)
                self._recover(HEARTBEAT_ERROR)

    def _on_rpdo(self, cob_id: int, data: bytes, t_ns: int) -> None:
        with self._lock:
            if self._dead or self._state is not NmtState.OPERATIONAL or cob_id not in self._rpdos:
                return
            if self._rpdos[cob_id].layout.transmission_type in EVENT_DRIVEN:
                self._put_into_effect(self._rpdos[cob_id], data)
            else:
                self._pending[cob_id] = data
            self._host.received(cob_id, t_ns)
            self._recover(RPDO_TIMEOUT)

    def _lose_host(self, error_code: int) -> None:
        self._reported.add(error_code)
        self._device.tell(error_code)
        self._device.lose_connection(error_code)
        self._pending.clear()
        self._send_emergencies()

    def _recover(self, error_code: int) -> None:
        if error_code in self._reported:
            self._reported.remove(error_code)
            self._device.recover(error_code)
            self._send_emergencies()

    def _put_into_effect(self, rpdo: PdoFrame, data: bytes) -> None:
        if len(data) != rpdo.size_bytes:  # CiA 301, 7.2.2.6: it is not processed, the error goes out as EMCY
            self._send_emergency(Emergency(_PDO_LENGTH_ERROR, 0, bytes(5)))
            return
        for mapped, value in rpdo.unpack(data):
            if mapped.index not in self._server.ignored_writes:
                with suppress(ObjectRefused):  # a PDO has no answer; the device says it in its statusword, where it can
                    self._device.write(mapped.index, value)

    def _on_sdo_request(self, data: bytes, t_ns: int) -> None:
        with self._lock:
            self.look_for_host(t_ns)
            if not self._dead and self._state is not NmtState.STOPPED:
                self._server.answer(data, t_ns)
                self._send_emergencies()

    def _on_read(self, *, index: int, subindex: int, od: Any) -> int | None:
        value = self._device.read(index, subindex)
        if (index, subindex) in self._sensors:
            value = self._sensed(index, subindex)
        elif (index, subindex) == _SERIAL_NUMBER:
            value = self._serial_number
        elif value is None and index == 0x1018 and self._eds.sheet.value(index, subindex) is None:
            value = self._identity.get(subindex)
        return None if value is None else fitting(value, od.data_type)

    def _on_write(self, *, index: int, subindex: int, od: Any, data: bytes) -> None:
        if od.data_type not in INTEGERS:
            return
        value = IntegerType(od.data_type).decode(data)
        try:
            self._pdo_objects.check_write(index, subindex, value)
            self._device.write(index, value)
        except ObjectRefused as refusal:
            raise SdoAbortedError(refusal.abort_code) from refusal
        if index == _PRODUCER_HEARTBEAT_TIME:
            self._start_heartbeat(value / 1000.0)
        elif (index, subindex) == _CONSUMER_HEARTBEAT_TIME:
            self._host.heartbeat = HeartbeatConsumer(value)
            self._hear(self._host.heartbeat.cob_id, self._on_heartbeat)
            if self._looking is None:
                self._looking = Ticker(LOOK_EVERY_S, self._look_by_the_clock, f"host watch of node {self._node_id}")

    def _source(self, index: int, subindex: int) -> Callable[[], int]:
        if (index, subindex) in self._sensors:
            return partial(self._sensed, index, subindex)
        return self._device.reader(index) or partial(self._value, index, subindex)

    def _sensed(self, index: int, subindex: int) -> int:
        """Read a further sensor as its converter does: saturating."""
        return fitting(self._sensors[index, subindex](), self._eds.integer_type(index, subindex))

    def _value(self, index: int, subindex: int) -> int:
        entry = self._eds.sheet.entry(index, subindex)
        if entry is None or entry.kind is None or entry.kind.bits is None:
            return 0
        return int.from_bytes(self._server.get_data(index, subindex), "little", signed=entry.kind.signed)

    def _start_heartbeat(self, period_s: float) -> None:
        self._stop_heartbeat()
        if period_s > 0.0:
            self._producer = HeartbeatProducer(self._link.send, self._node_id, period_s, lambda: self._state)

    def _look_by_the_clock(self) -> None:
        """Look for the host, in a thread of its own, unless a frame is being taken: then that has looked."""
        if self._lock.acquire(blocking=False):
            try:
                self.look_for_host(time.monotonic_ns())
            except BusDown:  # the rig is being closed
                return
            finally:
                self._lock.release()

    def _stop_heartbeat(self) -> None:
        if self._producer is not None:
            self._producer.stop()
            self._producer = None

    def _send_emergencies(self) -> None:
        for emergency in self._device.take_emergencies():
            self._send_emergency(emergency)

    def _send_emergency(self, emergency: Emergency) -> None:
        cob_id = EMCY_COB_ID + self._node_id
        if self._eds.sheet.value(_EMCY_COB_ID) is not None:
            cob_id = self._value(_EMCY_COB_ID, 0)
        if cob_id & 0x7FF and not cob_id & COB_ID_INVALID:
            self._send(cob_id & 0x7FF, emergency.encode())

    def _send(self, cob_id: int, data: bytes) -> None:
        if not self._off_bus:
            self._link.send(cob_id, data)
