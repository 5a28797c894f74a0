"""The tables of a rig file about devices: each inverter, and the PLC.

Of a drive: where it is, what it may give, how it stops by itself, what its data sheet does not say, and what somebody
has accepted that it lacks. Of the PLC: where it is, and how the connection to it is secured.

Modbus/TCP Security: both sides show a certificate signed by the authority in ``ca``. All paths are relative to the
rig file, all files PEM.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import Annotated, Any, Final, Self

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from drivers.capability.speed_unit import SpeedUnit, SpeedUnitName
from drivers.inverter.cia402 import TorqueMode
from drivers.inverter.drive_settings import ABORT_CONNECTION
from drivers.inverter.settings import Acceptance
from drivers.plc.modbus_security import ClientSecurity, Credentials
from drivers.plc.register import Access
from hil.config.table import ExistingFile, FileTable, Positive, TcpPort, Text, Unsigned32
from hil.problems import Fault, refuse

_OBJECTS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "abort_connection": ABORT_CONNECTION,
        "quick_stop": 0x605A,
        "shutdown": 0x605B,
        "disable_operation": 0x605C,
        "halt": 0x605D,
        "fault_reaction": 0x605E,
    }
)

_NODE_GUARDING: Final = ("guard_time_ms", "life_time_factor", "node_guarding")
"""What a person might call it who comes from another master."""


class SpeedUnitTable(FileTable):
    """Unit of the velocity actual value 0x606C, from the drive's manual; over what its data sheet says."""

    unit: Annotated[SpeedUnitName, Field(strict=False)]  # by name
    counts_per_unit: Positive = 1.0  # 10 where it reads tenths
    increments_per_turn: Positive | None = None  # where the unit counts increments, and only there

    @property
    def speed_unit(self) -> SpeedUnit:
        """The unit as the drivers take it."""
        return SpeedUnit(self.unit, self.counts_per_unit, self.increments_per_turn)

    @model_validator(mode="after")
    def _resolution_where_it_counts(self) -> Self:
        per_turn = self.increments_per_turn
        if self.speed_unit.needs_increments and per_turn is None:
            refuse(
                [Fault("increments_per_turn", f"the increments of one turn, since unit is {self.unit.value!r}", None)]
            )
        if not self.speed_unit.needs_increments and per_turn is not None:
            refuse([Fault("increments_per_turn", f"no such key while unit is {self.unit.value!r}", per_turn)])
        return self


class RatedTorqueUnit(Enum):
    """Unit of the motor rated torque 0x6076; CiA 402 has the thousandth."""

    MILLI = "mNm"
    MICRO = "uNm"

    @property
    def nm(self) -> float:
        """One count [Nm]."""
        return {RatedTorqueUnit.MILLI: 1e-3, RatedTorqueUnit.MICRO: 1e-6}[self]


class AcceptanceTable(FileTable):
    """Who accepted that it is missing, and why."""

    by: Text  # a person's name
    why: Text  # what stops the torque in its place, or why it does not have to

    @property
    def acceptance(self) -> Acceptance:
        """The acceptance as the drivers take it."""
        return Acceptance(self.by, self.why)


class AcceptedTable(FileTable):
    """What a drive lacks, by name; see `drivers.inverter.stop_proof`."""

    heartbeat_consumer: AcceptanceTable | None = None  # 0x1016
    rpdo_deadline: AcceptanceTable | None = None  # 0x1400:05
    abort_connection: AcceptanceTable | None = None  # 0x6007
    supported_modes: AcceptanceTable | None = None  # 0x6502

    @property
    def by_name(self) -> dict[str, Acceptance]:
        """What is accepted."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: table.acceptance for name, table in given.items() if table is not None}


def _mode_by_name(value: object) -> TorqueMode:
    """Read a mode of operation by its name; its number would say nothing to a person."""
    names = {mode.name.lower(): mode for mode in sorted(TorqueMode, key=lambda mode: mode.name)}
    if not isinstance(value, str) or value not in names:
        raise ValueError(" or ".join(map(repr, names)))
    return names[value]


NodeId = Annotated[int, Field(ge=1, le=127)]
"""Of CANopen."""


CobId = Annotated[int, Field(ge=0, le=0x7FF)]
"""Of 11 bits."""


OptionCode = Annotated[int, Field(ge=-32768, le=32767)]
"""INTEGER16; the negative codes are the maker's own."""


TimeOut = Annotated[float, Field(ge=0.05, le=60.0)]
"""Longest wait [s]: not so short that a healthy drive on a busy bus misses it."""


class OptionCodesTable(FileTable):
    """What the drive does by itself when something ends (CiA 402-2): a DCF's choice or its own, unless given here."""

    abort_connection: Annotated[int, Field(ge=1, le=3)] | None = None  # 0x6007
    quick_stop: OptionCode | None = None  # 0x605A
    shutdown: OptionCode | None = None  # 0x605B
    disable_operation: OptionCode | None = None  # 0x605C
    halt: OptionCode | None = None  # 0x605D
    fault_reaction: OptionCode | None = None  # 0x605E

    @property
    def by_object(self) -> dict[int, int]:
        """The codes that are given, by object."""
        codes = {index: getattr(self, name) for name, index in _OBJECTS.items()}
        return {index: code for index, code in codes.items() if code is not None}


class InverterTable(FileTable):
    """One inverter: where it is, what it must identify as, and what it may give.

    ``eds`` is relative to the rig file; without it the shipped ``inverter.eds`` counts. ``rpdo_deadline_ms`` is by
    default what `hil.config.rig_file.Rig.rpdo_deadline_ms` has.
    """

    node_id: NodeId  # of CANopen
    vendor_id: Unsigned32  # 0x1018:1
    product_code: Unsigned32  # 0x1018:2
    serial_number: Unsigned32 | None = None  # 0x1018:4; None: it is not compared
    rated_torque_nm: Positive  # 0x6076
    torque_limit_nm: Positive  # largest torque that it is ever commanded, base and PRBS together
    mode: Annotated[
        TorqueMode,
        BeforeValidator(_mode_by_name),
        WithJsonSchema({"enum": [mode.name.lower() for mode in TorqueMode], "type": "string"}),
    ]  # mode of operation, 0x6060
    heartbeat_ms: Annotated[int, Field(ge=10, le=65535)]  # period of its heartbeat, 0x1017
    # without the host's heartbeat for so long it takes the host for dead, 0x1016
    host_timeout_ms: Annotated[int, Field(ge=50, le=65535)] = 150
    rpdo_deadline_ms: Annotated[int, Field(ge=2, le=65535)] | None = None
    option_codes: OptionCodesTable = OptionCodesTable()  # what it does by itself when something ends
    torque_slope_nm_per_s: Positive | None = None  # 0x6087, of profile torque; None: the drive's own
    speed_unit: SpeedUnitTable | None = None  # of 0x606C; None: as its data sheet says
    rated_torque_unit: Annotated[RatedTorqueUnit, Field(strict=False)] = RatedTorqueUnit.MILLI  # of 0x6076
    accepted: AcceptedTable = AcceptedTable()  # what it lacks, and somebody accepts
    follow_bit: bool = True  # whether bit 12 of 0x6041 says that it follows its target
    sdo_timeout_s: TimeOut = 0.5  # of an SDO answer
    mode_timeout_s: TimeOut = 2.0  # of the mode of operation, 0x6061
    state_timeout_s: TimeOut = 2.0  # of a power state or NMT state
    eds: ExistingFile | None = None

    @model_validator(mode="before")
    @classmethod
    def _no_node_guarding(cls, keys: Any) -> Any:
        asked = [name for name in _NODE_GUARDING if isinstance(keys, Mapping) and name in keys]
        refuse(
            Fault(
                name,
                "no such key: node guarding needs remote frames and excludes the heartbeat (CiA 301), by which host "
                "and drive watch each other here; heartbeat_ms sets its period",
                keys[name],
            )
            for name in asked
        )
        return keys

    @model_validator(mode="after")
    def _limit_within_rated(self) -> Self:
        if self.torque_limit_nm > self.rated_torque_nm:
            expected = f"at most rated_torque_nm of the same table ({self.rated_torque_nm:g})"
            refuse([Fault("torque_limit_nm", expected, self.torque_limit_nm)])
        return self


class InvertersTable(FileTable):
    """The two inverters on the motor shaft."""

    m1: InverterTable  # its speed is the one that is recorded
    m2: InverterTable  # on the same shaft

    @model_validator(mode="after")
    def _two_nodes(self) -> Self:
        if self.m1.node_id == self.m2.node_id:
            refuse([Fault("m2.node_id", "another node id than m1", self.m2.node_id)])
        return self


class CredentialsTable(FileTable):
    """What one side trusts and shows; ``key`` without a password."""

    ca: ExistingFile  # certificate of the authority
    certificate: ExistingFile  # of this side, signed by the authority
    key: ExistingFile

    @property
    def credentials(self) -> Credentials:
        """The same as the drivers take it."""
        return Credentials(self.ca, self.certificate, self.key)


class PlcSecurityTable(CredentialsTable):
    """The host's side. ``server_name`` is the name in the PLC's certificate; without it that is ``[plc] host``."""

    server_name: Text | None = None

    @property
    def client(self) -> ClientSecurity:
        """The same as the drivers take it."""
        return ClientSecurity(self.credentials, self.server_name)


class PlcTable(FileTable):
    """The PLC. ``map`` is relative to the rig file; without it the shipped ``plc.toml`` counts.

    ``cob_ids`` are those under which its gateway, where it has one, sends on the rig's CAN bus.
    """

    host: Text  # name or IP address
    port: TcpPort  # of Modbus TCP
    map: ExistingFile | None = None
    cob_ids: Annotated[tuple[CobId, ...], Field(strict=False)] = ()
    security: PlcSecurityTable | None = None  # None: plain Modbus TCP


class SimulatedPlcSecurityTable(CredentialsTable):
    """The simulated PLC's side: its own certificate, and what each role in a client's certificate may do."""

    roles: Annotated[dict[Text, Annotated[Access, Field(strict=False)]], Field(min_length=1)]  # by name of the role
