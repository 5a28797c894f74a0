"""A simulated rig at two addresses: the CAN bus with both inverters and the driveline, and the PLC."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Self

import numpy as np

from drivers.canopen import can
from drivers.canopen.can_link import open_bus
from drivers.canopen.inline_bus import InlineBus
from drivers.capability.carrier import ObjectId
from drivers.plc.register import Register, ValueType
from hil.config.channel_table import ChannelTable
from hil.config.rig_file import InverterTable, Rig, SimulationTable
from hil.errors import UsageError
from hil.simulator.addresses import IN_PROCESS, SOCKETCAN, Address, bus_address
from hil.simulator.can_bridge import CanBridge
from hil.simulator.drive_physics import SimulatedInverter
from hil.simulator.faults import InverterFaults, RigFaults
from hil.simulator.faulty_wire import FaultyWire
from hil.simulator.plc_device import PlcDevice, PlcSetup
from hil.simulator.plc_server import PlcSecurity, PlcServer
from hil.simulator.simulated_rig import SensedPlant, SimulatedPlant, SimulatedRig

_OF_SENSORS = 2  # of a rig's random numbers: those of its nodes have streams of their own

_RANGES = {
    ValueType.UINT16: (0, (1 << 16) - 1),
    ValueType.INT16: (-(1 << 15), (1 << 15) - 1),
    ValueType.UINT32: (0, (1 << 32) - 1),
    ValueType.INT32: (-(1 << 31), (1 << 31) - 1),
}

SERIAL_NUMBERS = (1, 2)
"""Of the drives behind m1 and m2, unless the rig file says; they stay with them where the node ids are swapped."""

HOST_TIMEOUT_S = 1.0
"""Simulated time without a beat of the host after which the PLC permits no torque [s]: ten of the host's polls."""


class ChannelSensors:
    """The channels of one rig file on one plant."""

    def __init__(self, rig: Rig, plant: SimulatedPlant, seed: int) -> None:
        self._tables = tuple(rig.channels)
        self._plant = _sensed(rig, plant) if self._tables else None
        self._map = rig.register_map
        self._noise = {} if rig.simulation is None else rig.simulation.channel_noise
        self._random = np.random.default_rng([seed, 0, _OF_SENSORS])
        self._read = {table.column: 0.0 for table in self._tables}
        self.sample()  # what a driveline has no place for is refused here, and not at the first SYNC

    def sample(self) -> None:
        """Read every channel as it is now, with its noise."""
        if self._plant is not None:
            for table in self._tables:
                noise = self._noise.get(table.column, 0.0) * float(self._random.standard_normal())
                self._read[table.column] = self._plant.measured(table.kind, table.at) + noise

    def objects(self, inverter: str) -> Mapping[ObjectId, Callable[[], int]]:
        """Return the objects of one inverter (m1, m2) that hold channels, and what reads each [counts]."""
        return {
            table.object_id: partial(self._count, table)
            for table in self._tables
            if table.inverter == inverter and table.object_id is not None
        }

    def registers(self) -> dict[str, float]:
        """Return what the PLC's registers hold, by name, in the unit of its map."""
        return {table.register_name: self._held(table) for table in self._tables if table.register_name is not None}

    def _count(self, table: ChannelTable) -> int:
        return round(self._read[table.column] / table.factor(self._map))

    def _held(self, table: ChannelTable) -> float:
        register = self._map[table.register_name or ""]
        return _converted(register, self._read[table.column] / table.factor(self._map))


def _sensed(rig: Rig, plant: SimulatedPlant) -> SensedPlant:
    if not isinstance(plant, SensedPlant):
        listed = ", ".join(rig.channel_units)
        raise UsageError(
            f"rig {rig.name!r}, channels: expected a driveline that can be measured there, got one with a motor speed "
            f"alone ({listed}). Take [[channels]] out of this rig file."
        )
    return plant


def _converted(register: Register, value: float) -> float:
    """Convert as an analogue input does: in whole steps, and saturating."""
    if register.type not in _RANGES:
        return value
    step = 1.0 if register.scale is None else register.scale
    low, high = _RANGES[register.type]
    return min(max(round(value / step), low), high) * step


class RigServer:
    """Both inverters, the PLC and the driveline, served from `__enter__` to `__exit__`."""

    def __init__(
        self,
        plant: SimulatedPlant,  # The driveline
        rig: Rig,  # The rig file the simulated rig agrees with; it must have a table ``[simulation]``
        bus_url: str,
        modbus: Address,  # Where the PLC is served. Port 0 takes a free one, here as in ``bus_url``
        faults: RigFaults | None = None,  # What is wrong with the devices
        seed: int | None = None,  # Of all that is random; None for the one of the rig file
        real_time: bool = False,
    ) -> None:
        self._plant = plant
        self._rig = rig
        self._simulation = required_simulation(rig)
        self._seed = self._simulation.seed if seed is None else seed
        self._faults = faults or RigFaults()
        self._real_time = real_time
        self._bridged = None if bus_url.startswith((IN_PROCESS, SOCKETCAN)) else bus_address(bus_url)
        if bus_url.startswith(SOCKETCAN) and self._faults.bus.touch_frames:
            raise UsageError(
                f"bus {bus_url!r}: expected faults of the devices alone, got faults of the bus: frames of the "
                "kernel's own bus are out of reach. Serve it at ws://127.0.0.1:0/ for them."
            )
        self._bus_url = bus_url
        self._modbus = modbus
        self._stack = ExitStack()
        self._sensors = ChannelSensors(rig, plant, self._seed)
        self.plc = PlcDevice(_plc_setup(rig), self._faults.plc)

    @property
    def bus_url(self) -> str:
        """URL under which a host finds the bus; the port is known once the server runs."""
        return self._bus_url

    @property
    def modbus(self) -> Address:
        """Address of the PLC; the port is known once the server runs."""
        return self._modbus

    @property
    def torque_nm(self) -> tuple[float, float]:
        """Torques of the inverters in effect now [Nm], as the driveline feels them; while the rig is served."""
        return self._slaves.torque_nm

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            self._serve_plc(stack)  # before there is a SYNC that steps it
            self._serve_bus(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _serve_bus(self, stack: ExitStack) -> None:
        channel = self._bus_url.removeprefix(IN_PROCESS) if self._bridged is None else str(uuid.uuid4())
        self._slaves = slaves = SimulatedRig(
            self._devices_bus(channel, stack),
            self._plant,
            self._inverters(),
            self._rig.period_s,
            self._seed,
            self._real_time,
        )
        stack.enter_context(slaves)
        slaves.add_sensor(self._sense)
        slaves.add_step_callback(self._step_plc)
        slaves.add_torque_from(self._plc_torque_nm)
        if self._bridged is not None:
            self._bus_url = stack.enter_context(CanBridge(self._bridged, channel)).url

    def _devices_bus(self, channel: str, stack: ExitStack) -> can.BusABC:
        if self._bus_url.startswith(SOCKETCAN):
            return open_bus(self._bus_url)
        if not self._faults.bus.touch_frames:
            return InlineBus(channel)
        devices = str(uuid.uuid4())
        stack.enter_context(FaultyWire(channel, devices, self._faults.bus, self._seed))
        return InlineBus(devices)

    def _serve_plc(self, stack: ExitStack) -> None:
        self.plc.show(self._sensors.registers())
        self.plc_server = PlcServer(
            self.plc, self._rig.register_map, self._modbus.host, self._modbus.port, plc_security(self._simulation)
        )
        stack.enter_context(self.plc_server)
        self._modbus = Address(self._modbus.host, self.plc_server.port)

    def _sense(self) -> None:
        self._sensors.sample()
        self.plc.show(self._sensors.registers())

    def _step_plc(self, time_s: float) -> None:
        self.plc.step(self._rig.period_s)

    def _plc_torque_nm(self) -> tuple[float, float]:
        """Share the PLC's own PRBS out to the inverters as the rig file says."""
        prbs_nm, part_m1 = self.plc.prbs_torque_nm, self._rig.prbs.part_m1
        return part_m1 * prbs_nm, (1.0 - part_m1) * prbs_nm

    def _inverters(self) -> tuple[SimulatedInverter, SimulatedInverter]:
        tables, faults = self._rig.inverters, self._faults
        m1 = _inverter(tables.m1, self._simulation, faults.m1, self._sensors.objects("m1"), SERIAL_NUMBERS[0])
        m2 = _inverter(tables.m2, self._simulation, faults.m2, self._sensors.objects("m2"), SERIAL_NUMBERS[1])
        if faults.bus.swapped_nodes:
            return replace(m1, node_id=m2.node_id), replace(m2, node_id=m1.node_id)
        return m1, m2


def required_simulation(rig: Rig) -> SimulationTable:
    """Return the table [simulation]; `UsageError` where the rig file has none."""
    if rig.simulation is None:
        raise UsageError(
            f"rig {rig.name!r}: expected a table [simulation] that says what to simulate, there is none. "
            "Add it to the rig file, with seed, speed_noise_rad_s and torque_noise_permille."
        )
    return rig.simulation


def plc_security(simulation: SimulationTable) -> PlcSecurity | None:
    """Give the simulated PLC's certificate and roles; None where it speaks plain Modbus TCP."""
    table = simulation.plc_security
    return None if table is None else PlcSecurity(table.credentials, table.roles)


def _inverter(
    table: InverterTable,
    simulation: SimulationTable,
    faults: InverterFaults,
    sensors: Mapping[ObjectId, Callable[[], int]],
    serial_number: int,
) -> SimulatedInverter:
    return SimulatedInverter(
        node_id=table.node_id,
        rated_torque_nm=table.rated_torque_nm,
        torque_noise_counts=simulation.torque_noise_permille,  # a count is one per mille of the rated torque
        speed_noise_rad_s=simulation.speed_noise_rad_s,
        eds_path=table.eds,
        identity=(table.vendor_id, table.product_code),
        speed_unit=None if table.speed_unit is None else table.speed_unit.speed_unit,
        rated_torque_unit_nm=table.rated_torque_unit.nm,
        sensors=sensors,
        faults=faults,
        serial_number=serial_number if table.serial_number is None else table.serial_number,
    )


def _plc_setup(rig: Rig) -> PlcSetup:
    """Build a vehicle that permits what its own rig file may ask for."""
    largest_nm = max(rig.inverters.m1.torque_limit_nm, rig.inverters.m2.torque_limit_nm)
    return PlcSetup(torque_limit_nm=largest_nm, period_s=rig.period_s, host_timeout_s=HOST_TIMEOUT_S)
