"""The PLC over Modbus TCP: what it reports in SI units, and requests that are confirmed or raise.

::

    connect          open, then compare the identity registers with the map
    greet            beat, then look for the permissive: a PLC that has lost its host withdraws it until the next beat
    read_status      one request per run of adjacent registers
    write            read back; what the registers then hold must be what was written
    PRBS             started with torques that have passed the torque guard and with nothing else

The registers are those of a map file: ``eds/plc.toml``, or the rig's own.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Final, Self

from drivers.errors import ConfigMismatch
from drivers.plc.modbus_link import ModbusLink
from drivers.plc.modbus_security import ClientSecurity
from drivers.plc.named_registers import HostWatchdog, NamedRegisters, Reading
from drivers.plc.register import Value
from drivers.plc.register_map import RegisterMap, require_usable
from drivers.plc.types import ClutchState, DriveMode, PlcStatus, PrbsSettings, PrbsSource
from drivers.torque_guard import GuardedTorque

NS_PER_S: Final = 1_000_000_000

STATUS: Final = (
    "permissive",
    "drive_mode",
    "clutch",
    "speed_limit",
    "torque_limit",
    "plc_count",
    "host_count_seen",
    "prbs_torque",
    "prbs_enable",
    "prbs_amplitude",
    "prbs_divider",
    "prbs_seed",
    "prbs_source",
)

GENERATOR_OFF: Final = PrbsSettings(False, 0.0, 1, 1, PrbsSource.HOST)
"""The PLC's own generator stands still, whatever it was set to."""

BEAT_EVERY_S: Final = 0.1  # between two beats while nothing else asks the PLC for anything [s]
POLL_S: Final = 0.01  # pause between two looks while greeting [s]: about one PLC cycle


class Plc:
    """The PLC of the rig; an asynchronous context manager that connects and disconnects.

    Parameters
    ----------
    host, port
        Address of its Modbus TCP server.
    register_map : RegisterMap
        What its registers mean.
    timeout_s : float
        Time for connecting and for each answer [s].
    beat_timeout_s : float
        Time the PLC may leave a beat unseen [s].
    greeting_timeout_s : float
        Time it may take from the first beat to the permissive [s].
    patience_s : float
        Least time for each of these three [s].
    security : ClientSecurity or None
        How the connection is secured; None for plain Modbus TCP.
    clock_ns : callable
        Monotonic clock [ns]; stamps the status and times the time-outs above.

    Raises
    ------
    ConfigMismatch
        If the map can't be used; see `drivers.plc.register_map`.
    """

    def __init__(
        self,
        host: str,
        port: int,
        register_map: RegisterMap,
        *,
        timeout_s: float = 1.0,
        beat_timeout_s: float = 0.5,
        greeting_timeout_s: float = 0.5,
        patience_s: float = 0.0,
        security: ClientSecurity | None = None,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        require_usable(register_map)
        self._link = ModbusLink(host, port, register_map.device_id, max(timeout_s, patience_s), security)
        self._map = register_map
        self._registers = NamedRegisters(self._link, register_map)
        self._watchdog = HostWatchdog(self._registers, self._link.place, max(beat_timeout_s, patience_s), clock_ns)
        self._greeting_timeout_s = max(greeting_timeout_s, patience_s)
        self._clock_ns = clock_ns
        self._latest: PlcStatus | None = None
        self._setting_prbs = asyncio.Lock()  # who switches it off comes behind who still switches it on

    @property
    def latest(self) -> PlcStatus | None:
        """The last status read; None before the first."""
        return self._latest

    async def __aenter__(self) -> Self:
        await self.connect()
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    async def connect(self) -> None:
        """Open the connection, or open it again, and compare the PLC's identity with the map.

        Raises
        ------
        BusDown
            If no server is there.
        DeviceTimeout
            If it does not answer.
        ConfigMismatch
            If it is another PLC, or another version of its map, or TLS fails. The connection is closed again.
        """
        await self._link.open()
        try:
            await self._verify_identity()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Disconnect; safe to call twice."""
        self._link.close()
        self._watchdog.start_anew()

    async def greet(self) -> PlcStatus:
        """Beat until the PLC permits torque, for ``greeting_timeout_s`` at most, and give its status then.

        A PLC that watches its host withdraws the permissive when the beats of one end, and gives it back with those of
        the next: asked before its first beat, it would refuse every host after one that died.

        Raises
        ------
        BusDown, DeviceTimeout, ProtocolViolation, DeviceFault
            If it can't be read or written, or means nothing.
        """
        deadline_ns = self._clock_ns() + int(self._greeting_timeout_s * NS_PER_S)
        while True:
            await self.beat()
            status = await self.read_status()
            if status.permissive or self._clock_ns() >= deadline_ns:
                return status
            await asyncio.sleep(POLL_S)

    async def keep_beating(self, continues: Callable[[], bool]) -> None:
        """Beat every `BEAT_EVERY_S` as long as ``continues`` says so, once at least; no beat is broken off.

        Raises
        ------
        BusDown, DeviceTimeout, ProtocolViolation, DeviceFault
            If a beat can't be written, or is not seen.
        """
        await self.beat()
        while continues():
            await asyncio.sleep(BEAT_EVERY_S)
            await self.beat()

    async def beat(self) -> None:
        """Count the host's watchdog on by one, and see that the PLC has seen the beats before.

        Raises
        ------
        DeviceTimeout
            If the PLC has not seen the last beat for ``beat_timeout_s``: its program stands still.
        """
        await self._watchdog.beat()

    async def read_status(self) -> PlcStatus:
        """Read everything the PLC reports.

        Raises
        ------
        BusDown, DeviceTimeout, ProtocolViolation, DeviceFault
            If it can't be read, or means nothing.
        """
        t_ns = self._clock_ns()
        values = await self._registers.read(STATUS)
        self._latest = PlcStatus(
            drive_mode=DriveMode(values["drive_mode"]),
            clutch=ClutchState(values["clutch"]),
            permissive=bool(values["permissive"]),
            speed_limit_rad_s=float(values["speed_limit"]),
            torque_limit_nm=float(values["torque_limit"]),
            plc_count=int(values["plc_count"]),
            prbs=_prbs_settings(values),
            prbs_torque_nm=float(values["prbs_torque"]),
            t_ns=t_ns,
        )
        return self._latest

    async def start_prbs(self, m1: GuardedTorque, m2: GuardedTorque, clock_divider: int, seed: int) -> PrbsSettings:
        """Let the PLC's own generator run.

        Parameters
        ----------
        m1, m2 : GuardedTorque
            What each inverter will get of it at most, as the torque guard let it through; the PRBS parts of the two
            together are the amplitude.
        clock_divider : int
            PLC cycles each level is held.
        seed : int
            First state of the register, 1 to 1023.

        Returns
        -------
        PrbsSettings
            What the PLC holds now, read back.

        Raises
        ------
        ConfigMismatch
            If a value does not fit its register. Nothing was written.
        ProtocolViolation, DeviceFault
            If the PLC refuses a value, or holds another one afterwards. The generator stands still.
        """
        return await self._set_prbs(PrbsSettings(True, m1.prbs_nm + m2.prbs_nm, clock_divider, seed, PrbsSource.PLC))

    async def stop_prbs(self) -> PrbsSettings:
        """Switch the PLC's own generator off: the host makes the PRBS, and nobody may add another.

        Raises
        ------
        BusDown, DeviceTimeout, ProtocolViolation, DeviceFault
            If it can't be confirmed to be off.
        """
        return await self._set_prbs(GENERATOR_OFF)

    async def _set_prbs(self, settings: PrbsSettings) -> PrbsSettings:
        """Write the generator's settings; it stands still while they change."""
        values: dict[str, Value] = {
            "prbs_amplitude": settings.amplitude_nm,
            "prbs_divider": settings.clock_divider,
            "prbs_seed": settings.seed,
            "prbs_source": settings.source.value,
        }
        words = self._registers.encoded(values)
        async with self._setting_prbs:
            await self._registers.write(self._registers.encoded({"prbs_enable": False}))
            await self._registers.write(words)
            if settings.enabled:
                await self._registers.write(self._registers.encoded({"prbs_enable": True}))
        return settings

    async def _verify_identity(self) -> None:
        found = await self._registers.read(self._map.identity)
        wrong = [
            f"{name} is {found[name]}, expected {expected}"
            for name, expected in self._map.identity.items()
            if found[name] != expected
        ]
        if wrong:
            raise ConfigMismatch(
                f"{self._link.place}: {'; '.join(wrong)}, as register map {self._map.name!r} says. "
                "Check [plc] host and port of the rig file, or give the map of this PLC."
            )

    async def read_channels(self, names: Sequence[str]) -> tuple[float, ...]:
        """Read registers that hold numbers, each in the register's own unit.

        Raises
        ------
        BusDown, DeviceTimeout, ProtocolViolation, DeviceFault
            If one can't be read, or means nothing.
        """
        values = await self._registers.read(names)
        return tuple(float(values[name]) for name in names)

    async def read_registers(self) -> tuple[Reading, ...]:
        """Read every register of the map, in the order of the map; what can't be believed says so and is kept.

        Raises
        ------
        BusDown, DeviceTimeout
            If the PLC can't be asked, or does not answer.
        """
        return await self._registers.all()


def _prbs_settings(values: Mapping[str, Value]) -> PrbsSettings:
    return PrbsSettings(
        enabled=bool(values["prbs_enable"]),
        amplitude_nm=float(values["prbs_amplitude"]),
        clock_divider=int(values["prbs_divider"]),
        seed=int(values["prbs_seed"]),
        source=PrbsSource(values["prbs_source"]),
    )
