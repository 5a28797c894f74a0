"""A simulated rig at two addresses: the CAN bus with both inverters and the driveline, and the PLC.

Nothing here knows what the plant is: `hil sim` puts the driveline of the rig file behind it, the proof
another one.
"""

from __future__ import annotations

import uuid
from contextlib import ExitStack
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

import can

from drivers.register_map import load_register_map
from drivers.resources import data_file
from hil.config.rig_file import InverterTable, Rig, SimulationTable
from hil.errors import UsageError
from hil.simulator.can_bridge import CanBridge
from hil.simulator.inverter_settings import InverterFaults, SimulatedInverter
from hil.simulator.loopback import Address, bus_address
from hil.simulator.plant import Plant
from hil.simulator.plc_device import PlcDevice, PlcFaults, PlcSetup
from hil.simulator.plc_server import PlcServer
from hil.simulator.simulated_rig import SimulatedRig

IN_PROCESS = "virtual:"
"""Beginning of the bus URLs that are served inside this process only."""


@dataclass(frozen=True, slots=True)
class RigFaults:
    """What is wrong with the simulated devices; by default nothing."""

    m1: InverterFaults = field(default_factory=InverterFaults)
    m2: InverterFaults = field(default_factory=InverterFaults)
    plc: PlcFaults = field(default_factory=PlcFaults)


class RigServer:
    """Both inverters, the PLC and the driveline, served from `__enter__` to `__exit__`.

    Parameters
    ----------
    plant
        The driveline.
    rig
        The rig file the simulated rig agrees with; it must have a table ``[simulation]``.
    bus_url
        Where the CAN bus is served: ``ws://127.0.0.1:PORT/`` for other processes, ``virtual:NAME`` for this
        one.
    modbus
        Where the PLC is served. Port 0 takes a free one, here as in ``bus_url``.
    faults
        What is wrong with the devices.
    seed
        Of all reading noise; None for the one of the rig file.

    Raises
    ------
    UsageError
        If the rig file has no ``[simulation]``, or an address is not on this machine.
    BusDown
        On entry, if an address can't be served at.
    """

    def __init__(
        self,
        plant: Plant,
        rig: Rig,
        bus_url: str,
        modbus: Address,
        faults: RigFaults | None = None,
        seed: int | None = None,
    ) -> None:
        self._plant = plant
        self._rig = rig
        self._simulation = required_simulation(rig)
        self._seed = self._simulation.seed if seed is None else seed
        self._faults = faults or RigFaults()
        self._bridged = None if bus_url.startswith(IN_PROCESS) else bus_address(bus_url)
        self._bus_url = bus_url
        self._modbus = modbus
        self._stack = ExitStack()
        self.plc = PlcDevice(_plc_setup(rig), self._faults.plc)

    @property
    def bus_url(self) -> str:
        """URL under which a host finds the bus; the port is known once the server runs."""
        return self._bus_url

    @property
    def modbus(self) -> Address:
        """Address of the PLC; the port is known once the server runs."""
        return self._modbus

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            self._serve_plc(stack)  # before there is a SYNC that steps it
            self._serve_bus(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def _serve_bus(self, stack: ExitStack) -> None:
        channel = self._bus_url.removeprefix(IN_PROCESS) if self._bridged is None else str(uuid.uuid4())
        bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        slaves = SimulatedRig(bus, self._plant, self._inverters(), self._rig.period_s, self._seed)
        stack.enter_context(slaves)
        slaves.add_step_callback(self._step_plc)
        if self._bridged is not None:
            self._bus_url = stack.enter_context(CanBridge(self._bridged, channel)).url

    def _serve_plc(self, stack: ExitStack) -> None:
        register_map = load_register_map(self._rig.plc.map or data_file("plc.toml"))
        self.plc_server = PlcServer(self.plc, register_map, self._modbus.host, self._modbus.port)
        stack.enter_context(self.plc_server)
        self._modbus = Address(self._modbus.host, self.plc_server.port)
        self._hang_plc_if_due(0.0)

    def _step_plc(self, time_s: float) -> None:
        self.plc.step(self._rig.period_s)
        self._hang_plc_if_due(time_s)

    def _hang_plc_if_due(self, time_s: float) -> None:
        if time_s >= self._faults.plc.hangs_at_s:
            self.plc_server.pause()

    def _inverters(self) -> tuple[SimulatedInverter, SimulatedInverter]:
        tables = self._rig.inverters
        return (
            _inverter(tables.m1, self._simulation, self._faults.m1),
            _inverter(tables.m2, self._simulation, self._faults.m2),
        )


def required_simulation(rig: Rig) -> SimulationTable:
    """Give the table ``[simulation]`` of a rig file.

    Raises
    ------
    UsageError
        If it has none.
    """
    if rig.simulation is None:
        raise UsageError(
            f"rig {rig.name!r}: expected a table [simulation] that says what to simulate, there is none. "
            "Add it to the rig file, with seed, speed_noise_rad_s and torque_noise_permille."
        )
    return rig.simulation


def _inverter(table: InverterTable, simulation: SimulationTable, faults: InverterFaults) -> SimulatedInverter:
    return SimulatedInverter(
        node_id=table.node_id,
        rated_torque_nm=table.rated_torque_nm,
        torque_noise_counts=simulation.torque_noise_permille,  # a count is one per mille of the rated torque
        speed_noise_rad_s=simulation.speed_noise_rad_s,
        eds_path=table.eds,
        faults=faults,
    )


def _plc_setup(rig: Rig) -> PlcSetup:
    """Build a vehicle that permits what its own rig file may ask for."""
    largest_nm = max(rig.inverters.m1.torque_limit_nm, rig.inverters.m2.torque_limit_nm)
    return PlcSetup(torque_limit_nm=largest_nm, period_s=rig.period_s)
