"""The rig file: one TOML file that says what is connected, and what it may be asked to do.

Strict and frozen: a number is no text, an unknown key is a fault, and nothing that limits torque has a
default. Rules that hold across keys stand next to the keys they concern; `hil.problems` reports all
faults at once. Those across tables come last: they take the worst case of each experiment against the limits of the
torque guard, and what the run would refuse is refused before it.

The base torque of an experiment is that of both inverters together and is split evenly between them, unless its
``share_m1`` says otherwise; so is the PRBS, unless ``[prbs] target`` does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import tomlkit
from pydantic import Field, PrivateAttr, model_validator

from drivers.capability.plan import plan_drive
from drivers.datasheet.file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.foreign_file import read_regular_text
from drivers.inverter.vehicle import Vehicle
from drivers.plc.register_map import RegisterMap, RegisterMapError, load_register_map, require_usable
from drivers.plc.types import PrbsSource
from drivers.resources import data_file
from drivers.torque_guard import GuardLimits
from estimator.signals.multisine import FEWEST_LINES
from hil.config.channel_table import ChannelTable
from hil.config.device_tables import (
    InvertersTable,
    InverterTable as InverterTable,
    NodeId,
    PlcTable as PlcTable,
    SimulatedPlcSecurityTable,
)
from hil.config.experiment_tables import EVEN_SHARE, AnyExperiment, PrbsTable, PrbsTarget as PrbsTarget
from hil.config.guard_table import GuardTable
from hil.config.table import ExistingFile, FileTable, NotNegative, Positive, Text
from hil.errors import RigFileError
from hil.problems import Fault, read_toml, refuse, validate


class CanTable(FileTable):
    """The CAN bus: ``url`` as the drivers read it.

    ``host_node_id`` is that of this program's own heartbeat, ``monitor_node_id`` that of `hil monitor`: by default the
    two highest that no inverter has.
    """

    url: Text
    host_node_id: NodeId | None = None
    monitor_node_id: NodeId | None = None


class VehicleTable(FileTable):
    """What is known of the vehicle beforehand; ``inertia_kg_m2`` is the total at the motor shaft.

    Empty it has half of it and full one and a half times as much, where the file does not say. ``most_grade`` is the
    steepest road, rise over way; ``travel_m_per_rad`` the way per angle of the shaft, wheel radius over gear ratio.
    """

    inertia_kg_m2: Positive
    inertia_empty_kg_m2: Positive | None = None  # None: half of `inertia_kg_m2`
    inertia_full_kg_m2: Positive | None = None  # None: one and a half times `inertia_kg_m2`
    most_grade: Annotated[float, Field(ge=0, le=1)] = 0.12
    travel_m_per_rad: Positive = 0.086

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle as the supervision of a run takes it."""
        usual, empty, full = self.inertia_kg_m2, self.inertia_empty_kg_m2, self.inertia_full_kg_m2
        return Vehicle(usual, empty or 0.5 * usual, full or 1.5 * usual, self.most_grade, self.travel_m_per_rad)

    @model_validator(mode="after")
    def _empty_to_full(self) -> Self:
        usual, empty, full = self.inertia_kg_m2, self.inertia_empty_kg_m2, self.inertia_full_kg_m2
        if empty is not None and empty > usual:
            refuse([Fault("inertia_empty_kg_m2", f"at most inertia_kg_m2 of the same table ({usual:g})", empty)])
        if full is not None and full < usual:
            refuse([Fault("inertia_full_kg_m2", f"at least inertia_kg_m2 of the same table ({usual:g})", full)])
        return self


class SimulationTable(FileTable):
    """What the simulated rig is, where `hil sim` and `hil demo` stand in for the real one.

    ``model`` is a model file relative to the rig file; without it the default two-mass bus counts. ``channel_noise``
    has the standard deviation of each channel's reading, by its column and in its unit; 0 where it has none.
    """

    model: ExistingFile | None = None
    seed: Annotated[int, Field(ge=0)]  # of all that is random
    speed_noise_rad_s: NotNegative  # standard deviation of each resolver's reading
    torque_noise_permille: NotNegative  # standard deviation of 0x6077 [per mille of rated]
    channel_noise: dict[str, NotNegative] = Field(default_factory=dict)
    plc_security: SimulatedPlcSecurityTable | None = None  # None: it speaks plain Modbus TCP


class DesignTable(FileTable):
    """What an experiment that the program designs may ask of the vehicle, at the motor shaft.

    Torque is the base torque of both inverters together. What is left out is as the file's own experiments go; the
    angle from where a recorded part begins is then free.
    """

    most_torque_nm: Positive | None = None  # largest base torque
    most_speed_rad_s: Positive | None = None  # largest magnitude
    most_duration_s: Positive | None = None  # of the recorded part
    most_angle_rad: Positive | None = None  # None: free


class Rig(FileTable):
    """One rig file. The key ``schema`` is `schema_id` here: pydantic has a use of its own for that name."""

    schema_id: Annotated[Literal["hil.rig/1"], Field(alias="schema")]
    name: Text  # for people, and in results
    period_s: Annotated[float, Field(ge=0.001, le=1)] = 0.01  # from one SYNC to the next
    can: CanTable  # the bus of both inverters
    inverters: InvertersTable  # both, on one shaft
    plc: PlcTable  # what permits torque
    guard: GuardTable  # limits of torque, and of what comes back
    prbs: PrbsTable  # what excites, unless an experiment has its own
    vehicle: VehicleTable  # what is known of it beforehand
    # further ones that are recorded, in the order of the columns
    channels: list[ChannelTable] = Field(default_factory=list)
    experiments: dict[str, AnyExperiment] = Field(default_factory=dict)  # by name
    design: DesignTable = DesignTable()  # limits of experiments that the program designs
    simulation: SimulationTable | None = None  # None: the rig can't be simulated
    _takes_over: bool = PrivateAttr(default=False)  # set by `taking_over`

    @property
    def takes_over(self) -> bool:
        """Whether another host on the bus is put up with: asked for by the command line, and nothing of the file."""
        return self._takes_over

    def taking_over(self) -> Self:
        """Return the same rig, with another host put up with where its drives are disabled."""
        rig = self.model_copy()
        rig._takes_over = True  # noqa: SLF001 - of this very class
        return rig

    @property
    def host_node_id(self) -> int:
        """Node id of the host's own heartbeat."""
        given = self.can.host_node_id
        return self._free_node_ids(self.can.monitor_node_id)[0] if given is None else given

    @property
    def monitor_node_id(self) -> int:
        """Node id of the heartbeat of `hil monitor`."""
        given = self.can.monitor_node_id
        return self._free_node_ids(self.host_node_id)[0] if given is None else given

    @property
    def channel_units(self) -> dict[str, str]:
        """Column and unit of each channel, in the order of a recording."""
        return {channel.column: channel.unit for channel in self.channels}

    @property
    def register_map(self) -> RegisterMap:
        """The PLC's register map, read anew."""
        return load_register_map(self.plc.map or data_file("plc.toml"))

    @property
    def of_monitor(self) -> Self:
        """The same rig for `hil monitor`, which is a host with a heartbeat of its own."""
        ids = {"host_node_id": self.monitor_node_id, "monitor_node_id": self.host_node_id}
        return self.model_copy(update={"can": self.can.model_copy(update=ids)})

    def rpdo_deadline_ms(self, table: InverterTable) -> int:
        """Give the deadline of an inverter's RPDO: 150 ms where the rig file has none, at long periods two and a half.

        With 150 ms for the host's heartbeat as well, and what a drive takes to look, a dead host means zero torque
        within 0.25 s.
        """
        given = table.rpdo_deadline_ms
        return max(150, math.ceil(2500.0 * self.period_s)) if given is None else given

    def _free_node_ids(self, taken: int | None) -> list[int]:
        used = {self.inverters.m1.node_id, self.inverters.m2.node_id, taken}
        return [node_id for node_id in range(127, 0, -1) if node_id not in used]

    def excitation_nm(self, table: AnyExperiment) -> float:
        """Give the amplitude of what is superposed in an experiment, of both inverters together [Nm]; 0 for nothing."""
        if not table.prbs:
            return 0.0
        if table.multisine is not None:
            return table.multisine.amplitude_nm
        return self.prbs.amplitude_nm if table.prbs_amplitude_nm is None else table.prbs_amplitude_nm

    @property
    def torque_limits(self) -> GuardLimits:
        """What this rig may be asked for in all, whoever asks."""
        return GuardLimits(
            torque_limit_m1_nm=self.inverters.m1.torque_limit_nm,
            torque_limit_m2_nm=self.inverters.m2.torque_limit_nm,
            prbs_limit_nm=self.guard.prbs_limit_nm,
            rate_limit_nm_per_s=self.guard.rate_limit_nm_per_s,
            sum_limit_nm=self.guard.sum_limit_nm,
            feedback_timeout_s=self.guard.feedback_timeout_s,
            permissive_timeout_s=self.guard.permissive_timeout_s,
            speed_limit_rad_s=math.inf if self.guard.speed_limit_rad_s is None else self.guard.speed_limit_rad_s,
            period_s=self.period_s,
            error=self.guard.error_limits(self.inverters, self.period_s),
        )

    @property
    def guard_limits(self) -> GuardLimits:
        """The limits of this rig's torque guard: a PRBS that the PLC adds by itself is kept free under each."""
        if self.prbs.source is PrbsSource.HOST:
            return self.torque_limits
        parts_nm = self.prbs.parts_nm
        return replace(
            self.torque_limits,
            torque_limit_m1_nm=self.inverters.m1.torque_limit_nm - parts_nm["m1"],
            torque_limit_m2_nm=self.inverters.m2.torque_limit_nm - parts_nm["m2"],
            sum_limit_nm=self.guard.sum_limit_nm - self.prbs.amplitude_nm,
        )

    @model_validator(mode="after")
    def _within_limits(self) -> Self:
        refuse(faults_across_tables(self))
        return self


def read_rig(path: Path | str) -> Rig:
    """Read and check one rig file.

    Parameters
    ----------
    path : Path or str
        The file.

    Returns
    -------
    Rig
        Paths in it are absolute.

    Raises
    ------
    RigFileError
        Naming every fault of the file, or of EDS and register map it names: line or key, expected, got.
    """
    file = Path(path)
    rig = validate(Rig, read_toml(file, RigFileError), file, RigFileError)
    for name, table in (("m1", rig.inverters.m1), ("m2", rig.inverters.m2)):
        if table.eds is not None:
            _require_eds(file, f"inverters.{name}.eds", table.eds, table.node_id)
    if rig.plc.map is not None:
        _require_map(rig.plc.map)
    if faults := list(_channels_nothing_gives(rig)):
        raise RigFileError(file, *faults)
    return rig


def with_experiment_of(path: Path, experiment: str) -> tuple[Rig, str | None, str]:
    """Read a rig file for one of its experiments, or with the one that a file of its own has."""
    file = Path(experiment)
    rig = read_rig(path)
    if experiment in rig.experiments or file.suffix.lower() != ".toml":
        return rig, None, experiment
    tables = read_toml(file, RigFileError).get("experiments")
    if not isinstance(tables, dict) or len(tables) != 1:
        raise RigFileError(file, "experiments | expected one table [experiments.NAME] | got none, or several")
    (name,) = tables
    if name in rig.experiments:
        raise RigFileError(
            file, f"experiments.{name} | expected a name that {path} does not have | got one that it has"
        )
    document = tomlkit.parse(read_regular_text(path))
    if "experiments" not in document:
        document.add("experiments", tomlkit.table(is_super_table=True))
    added: Any = document["experiments"]
    added.add(name, tables[name])
    text = tomlkit.dumps(document)
    return validate(Rig, tomlkit.parse(text).unwrap(), path, RigFileError), text, name


def _channels_nothing_gives(rig: Rig) -> Iterator[str]:
    """Say which channel neither a TPDO nor the register map can give."""
    for number, channel in enumerate(rig.channels):
        key = f"channels.{number}"
        if channel.object_id is None:
            if fault := channel.register_fault(rig.register_map):
                yield f"{key}.register | {fault}"
            continue
        table: InverterTable = getattr(rig.inverters, channel.inverter or "")
        plan = plan_drive(EdsFile(table.eds, table.node_id).sheet, [channel.object_id])
        try:
            plan.channel_carriers()
        except ConfigMismatch as cause:
            yield f"{key}.object | {cause}"


def _require_eds(file: Path, key: str, eds: Path, node_id: int) -> None:
    """See that a rig's own EDS can be read; whether the drive agrees with it is for the drive to say."""
    try:
        EdsFile(eds, node_id)
    except ConfigMismatch as cause:
        raise RigFileError(file, f"{key} | expected an EDS | got: {cause}") from cause


def _require_map(path: Path) -> None:
    """See that a rig's own register map can be used, before anything is connected."""
    try:
        require_usable(load_register_map(path))
    except RegisterMapError as cause:
        raise RigFileError(path, *cause.problems) from cause
    except ConfigMismatch as cause:
        raise RigFileError(path, str(cause)) from cause


def faults_across_tables(rig: Rig) -> Iterator[Fault]:
    """Find every rule across tables that a rig file breaks."""
    for faults in (
        _guard_faults,
        _deadline_faults,
        _node_faults,
        _channel_faults,
        _prbs_faults,
        _experiment_faults,
        _security_faults,
    ):
        yield from faults(rig)


def _guard_faults(rig: Rig) -> Iterator[Fault]:
    both_nm = rig.inverters.m1.torque_limit_nm + rig.inverters.m2.torque_limit_nm
    if rig.guard.sum_limit_nm > both_nm:
        expected = f"at most the torque limits of m1 and m2 together ({both_nm:g})"
        yield Fault("guard.sum_limit_nm", expected, rig.guard.sum_limit_nm)
    if rig.guard.feedback_timeout_s < rig.period_s:
        expected = f"at least one period ({rig.period_s:g})"
        yield Fault("guard.feedback_timeout_s", expected, rig.guard.feedback_timeout_s)


def _deadline_faults(rig: Rig) -> Iterator[Fault]:
    least_ms = 2000.0 * rig.period_s
    for name, table in (("m1", rig.inverters.m1), ("m2", rig.inverters.m2)):
        if table.rpdo_deadline_ms is not None and table.rpdo_deadline_ms < least_ms:
            expected = f"at least two periods ({least_ms:g}), or one RPDO that is late stops the drive"
            yield Fault(f"inverters.{name}.rpdo_deadline_ms", expected, table.rpdo_deadline_ms)


def _node_faults(rig: Rig) -> Iterator[Fault]:
    """See that every node has an id of its own."""
    used = [rig.inverters.m1.node_id, rig.inverters.m2.node_id]
    for name in ("host_node_id", "monitor_node_id"):
        node_id = getattr(rig.can, name)
        if node_id in used:
            yield Fault(f"can.{name}", f"another node id than {', '.join(map(str, used))}", node_id)
        elif node_id is not None:
            used.append(node_id)


def _channel_faults(rig: Rig) -> Iterator[Fault]:
    """See that every channel has a column of its own."""
    names = [channel.column for channel in rig.channels]
    for number, name in enumerate(names):
        if name in names[:number]:
            yield Fault(f"channels.{number}.column", "another column than the channels before it", name)
    noisy = {} if rig.simulation is None else rig.simulation.channel_noise
    for name in (name for name in noisy if name not in names):
        yield Fault(f"simulation.channel_noise.{name}", f"a column of [[channels]] ({', '.join(names)})", noisy[name])


def _security_faults(rig: Rig) -> Iterator[Fault]:
    """See that the simulated PLC wants TLS if, and only if, the host speaks it."""
    if rig.simulation is not None and (rig.plc.security is None) != (rig.simulation.plc_security is None):
        expected = "this table if and only if there is [plc.security]: both sides speak TLS, or neither"
        yield Fault("simulation.plc_security", expected, rig.simulation.plc_security and {})


def _prbs_faults(rig: Rig) -> Iterator[Fault]:
    largest_nm = max(rig.prbs.parts_nm.values())
    if largest_nm > rig.guard.prbs_limit_nm:
        expected = (
            f"a part of at most guard.prbs_limit_nm ({rig.guard.prbs_limit_nm:g}) for each inverter, "
            f"but one carries {largest_nm:g}"
        )
        yield Fault("prbs.amplitude_nm", expected, rig.prbs.amplitude_nm)
    if rig.prbs.source is PrbsSource.PLC:
        yield from _room_faults(rig)


def _room_faults(rig: Rig) -> Iterator[Fault]:
    """See that a PRBS the PLC adds by itself leaves the guard something to guard."""
    for rest_nm, of in torque_rests(rig, EVEN_SHARE):
        if rest_nm <= 0.0:
            expected = f"less than {of} allows, since source is 'plc'"
            yield Fault("prbs.amplitude_nm", expected, rig.prbs.amplitude_nm)


def _experiment_faults(rig: Rig) -> Iterator[Fault]:
    for name, experiment in rig.experiments.items():
        key = f"experiments.{name}"
        yield from _excitation_faults(rig, key, experiment)
        amplitude_nm = max(rig.prbs.amplitude_nm, rig.excitation_nm(experiment))
        for rest_nm, of in torque_rests(rig, experiment.share_m1, amplitude_nm):
            if experiment.torque_nm > rest_nm:
                expected = f"at most {rest_nm:g}, what {of} leaves besides the PRBS"
                yield Fault(f"{key}.torque_nm", expected, experiment.torque_nm)
        fastest = rig.guard.rate_limit_nm_per_s / max(experiment.share_m1, 1.0 - experiment.share_m1)
        if experiment.slew_nm_per_s > fastest:
            expected = f"at most {fastest:g}, of which one inverter gets what guard.rate_limit_nm_per_s allows"
            yield Fault(f"{key}.slew_nm_per_s", expected, experiment.slew_nm_per_s)


def _excitation_faults(rig: Rig, key: str, experiment: AnyExperiment) -> Iterator[Fault]:
    """See that what an experiment superposes by itself is there, is the host's to send, and passes the guard."""
    if (table := experiment.multisine) is not None:
        where, nyquist_hz = f"{key}.multisine", 0.5 / rig.period_s
        if table.highest_hz >= nyquist_hz:
            yield Fault(f"{where}.highest_hz", f"below half the sampling rate ({nyquist_hz:g})", table.highest_hz)
        elif table.excited(rig.period_s).size < FEWEST_LINES:
            expected = f"a band with at least {FEWEST_LINES} of its lines, which are {1.0 / table.period_s:g} Hz apart"
            yield Fault(f"{where}.highest_hz", expected, table.highest_hz)
        if experiment.duration_s < table.period_s:
            yield Fault(f"{where}.period_s", f"at most duration_s ({experiment.duration_s:g})", table.period_s)
        where = f"{where}.amplitude_nm"
    elif experiment.prbs_amplitude_nm is not None or experiment.prbs_clock_divider is not None:
        where = f"{key}.prbs_amplitude_nm"
    else:
        return
    if rig.prbs.source is PrbsSource.PLC:
        yield Fault(where, "no such key while prbs.source is 'plc', whose generator has one setting", None)
    part = max(rig.prbs.part_m1, 1.0 - rig.prbs.part_m1)
    if part * rig.excitation_nm(experiment) > rig.guard.prbs_limit_nm:
        expected = f"at most {rig.guard.prbs_limit_nm / part:g}, of which one inverter gets guard.prbs_limit_nm"
        yield Fault(where, expected, rig.excitation_nm(experiment))


def torque_rests(rig: Rig, share_m1: float, amplitude_nm: float | None = None) -> Iterator[tuple[float, str]]:
    """Largest base torque of both inverters that each limit leaves besides the PRBS [Nm], and its key.

    ``share_m1`` is the part of the base torque that inverter m1 gives, 0 to 1; ``amplitude_nm`` that of the PRBS, or of
    what an experiment has in its place.
    """
    amplitude_nm = rig.prbs.amplitude_nm if amplitude_nm is None else amplitude_nm
    parts_nm = {"m1": rig.prbs.part_m1 * amplitude_nm, "m2": (1.0 - rig.prbs.part_m1) * amplitude_nm}
    yield rig.guard.sum_limit_nm - amplitude_nm, "guard.sum_limit_nm"
    for name, table, share in (("m1", rig.inverters.m1, share_m1), ("m2", rig.inverters.m2, 1.0 - share_m1)):
        if share > 0.0:
            yield (table.torque_limit_nm - parts_nm[name]) / share, f"inverters.{name}.torque_limit_nm"
