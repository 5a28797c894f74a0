"""The rig file: one TOML file that says what is connected, and what it may be asked to do.

Strict and frozen: a number is no text, an unknown key is a fault, and nothing that limits torque has a
default. Rules that hold across keys stand beside the keys they concern; `hil.config.problems` reports all
faults at once. Those across tables are looked at once every table is right by itself.

The base torque of an experiment is that of both inverters together and is split evenly between them; so is
the PRBS, unless ``[prbs] target`` says otherwise. The rules across keys check the worst case of each
experiment against the limits of the torque guard: what the run would refuse is refused before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from drivers.cia402 import TorqueMode
from drivers.eds_file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.plc_map import require_usable
from drivers.plc_types import PrbsSource
from drivers.register_map import RegisterMapError, load_register_map
from drivers.torque_guard import GuardLimits
from hil.config.experiment_tables import AnyExperiment
from hil.config.problems import Fault, read_toml, refuse, validate
from hil.config.table import ExistingFile, NotNegative, Positive, Table, TcpPort, Text, Unsigned32
from hil.errors import RigFileError


class PrbsTarget(Enum):
    """Which inverter carries the PRBS."""

    BOTH = "both"
    M1 = "m1"
    M2 = "m2"
    SHARED = "shared"


def _mode_by_name(value: object) -> TorqueMode:
    """Read a mode of operation by its name; its number would say nothing to a person."""
    names = {mode.name.lower(): mode for mode in sorted(TorqueMode, key=lambda mode: mode.name)}
    if not isinstance(value, str) or value not in names:
        raise ValueError(" or ".join(map(repr, names)))
    return names[value]


class CanTable(Table):
    """The CAN bus: ``url`` as the drivers read it."""

    url: Text


class InverterTable(Table):
    """One inverter: where it is, what it must identify as, and what it may give.

    ``eds`` is relative to the rig file; without it the shipped ``inverter.eds`` counts.
    """

    node_id: Annotated[int, Field(ge=1, le=127)]
    vendor_id: Unsigned32
    product_code: Unsigned32
    rated_torque_nm: Positive
    torque_limit_nm: Positive
    mode: Annotated[TorqueMode, BeforeValidator(_mode_by_name)]
    heartbeat_ms: Annotated[int, Field(ge=10, le=65535)]
    eds: ExistingFile | None = None

    @model_validator(mode="after")
    def _limit_within_rated(self) -> Self:
        if self.torque_limit_nm > self.rated_torque_nm:
            expected = f"at most rated_torque_nm of the same table ({self.rated_torque_nm:g})"
            refuse([Fault("torque_limit_nm", expected, self.torque_limit_nm)])
        return self


class InvertersTable(Table):
    """The two inverters on the motor shaft."""

    m1: InverterTable
    m2: InverterTable

    @model_validator(mode="after")
    def _two_nodes(self) -> Self:
        if self.m1.node_id == self.m2.node_id:
            refuse([Fault("m2.node_id", "another node id than m1", self.m2.node_id)])
        return self


class PlcTable(Table):
    """The PLC. ``map`` is relative to the rig file; without it the shipped ``plc.toml`` counts."""

    host: Text
    port: TcpPort
    map: ExistingFile | None = None


class GuardTable(Table):
    """Limits of the torque guard beside the torque limit of each inverter; see `drivers.torque_guard`."""

    rate_limit_nm_per_s: Positive
    prbs_limit_nm: Positive
    sum_limit_nm: Positive
    feedback_timeout_s: Positive


class PrbsTable(Table):
    """The pseudo-random binary torque; ``amplitude_nm`` is that of both inverters together."""

    amplitude_nm: Positive
    cells: Annotated[int, Field(ge=2, le=16)] = 10
    clock_divider: Annotated[int, Field(ge=1, le=65535)]
    seed: Annotated[int, Field(ge=1, le=65535)]
    source: Annotated[PrbsSource, Field(strict=False)]
    target: Annotated[PrbsTarget, Field(strict=False)]
    share_m1: Annotated[float, Field(ge=0, le=1)] | None = None

    @property
    def part_m1(self) -> float:
        """Part of the PRBS that inverter m1 carries, 0 to 1; m2 carries the rest."""
        fixed = {PrbsTarget.BOTH: 0.5, PrbsTarget.M1: 1.0, PrbsTarget.M2: 0.0}
        return fixed.get(self.target, self.share_m1 or 0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        refuse(self._faults())
        return self

    def _faults(self) -> Iterator[Fault]:
        shared = self.target is PrbsTarget.SHARED
        if shared and self.share_m1 is None:
            yield Fault("share_m1", "the part of inverter m1, 0 to 1, since target is 'shared'", None)
        if not shared and self.share_m1 is not None:
            yield Fault("share_m1", f"no such key while target is '{self.target.value}'", self.share_m1)
        if self.seed >= 2**self.cells:
            yield Fault("seed", f"at most {2**self.cells - 1}, what {self.cells} cells hold", self.seed)
        if self.source is PrbsSource.PLC and self.cells != 10:
            yield Fault("cells", "10, the PLC's own shift register, since source is 'plc'", self.cells)


class VehicleTable(Table):
    """What is known of the vehicle beforehand; ``inertia_kg_m2`` is the total at the motor shaft."""

    inertia_kg_m2: Positive


class SimulationTable(Table):
    """What the simulated rig is, where `hil sim` and `hil demo` stand in for the real one.

    ``model`` is a model file relative to the rig file; without it the default two-mass bus counts.
    """

    model: ExistingFile | None = None
    seed: Annotated[int, Field(ge=0)]
    speed_noise_rad_s: NotNegative
    torque_noise_permille: NotNegative


class Rig(Table):
    """One rig file. The key ``schema`` is `schema_id` here: pydantic has a use of its own for that name."""

    schema_id: Annotated[Literal["hil.rig/1"], Field(alias="schema")]
    name: Text
    period_s: Annotated[float, Field(gt=0, le=1)]
    can: CanTable
    inverters: InvertersTable
    plc: PlcTable
    guard: GuardTable
    prbs: PrbsTable
    vehicle: VehicleTable
    experiments: dict[str, AnyExperiment] = Field(default_factory=dict)
    simulation: SimulationTable | None = None

    @property
    def guard_limits(self) -> GuardLimits:
        """The limits of this rig's torque guard."""
        return GuardLimits(
            torque_limit_m1_nm=self.inverters.m1.torque_limit_nm,
            torque_limit_m2_nm=self.inverters.m2.torque_limit_nm,
            prbs_limit_nm=self.guard.prbs_limit_nm,
            rate_limit_nm_per_s=self.guard.rate_limit_nm_per_s,
            sum_limit_nm=self.guard.sum_limit_nm,
            feedback_timeout_s=self.guard.feedback_timeout_s,
        )

    @model_validator(mode="after")
    def _within_limits(self) -> Self:
        refuse([*self._guard_faults(), *self._prbs_faults(), *self._experiment_faults()])
        return self

    def _prbs_parts_nm(self) -> dict[str, float]:
        part_m1 = self.prbs.part_m1
        return {"m1": part_m1 * self.prbs.amplitude_nm, "m2": (1.0 - part_m1) * self.prbs.amplitude_nm}

    def _guard_faults(self) -> Iterator[Fault]:
        both_nm = self.inverters.m1.torque_limit_nm + self.inverters.m2.torque_limit_nm
        if self.guard.sum_limit_nm > both_nm:
            expected = f"at most the torque limits of m1 and m2 together ({both_nm:g})"
            yield Fault("guard.sum_limit_nm", expected, self.guard.sum_limit_nm)
        if self.guard.feedback_timeout_s < self.period_s:
            expected = f"at least one period ({self.period_s:g})"
            yield Fault("guard.feedback_timeout_s", expected, self.guard.feedback_timeout_s)

    def _prbs_faults(self) -> Iterator[Fault]:
        largest_nm = max(self._prbs_parts_nm().values())
        if largest_nm > self.guard.prbs_limit_nm:
            expected = (
                f"a part of at most guard.prbs_limit_nm ({self.guard.prbs_limit_nm:g}) for each inverter, "
                f"but one carries {largest_nm:g}"
            )
            yield Fault("prbs.amplitude_nm", expected, self.prbs.amplitude_nm)

    def _experiment_faults(self) -> Iterator[Fault]:
        for name, experiment in self.experiments.items():
            key = f"experiments.{name}"
            for rest_nm, of in self._torque_rests():
                if experiment.torque_nm > rest_nm:
                    expected = f"at most {rest_nm:g}, what {of} leaves beside the PRBS"
                    yield Fault(f"{key}.torque_nm", expected, experiment.torque_nm)
            fastest = 2.0 * self.guard.rate_limit_nm_per_s
            if experiment.slew_nm_per_s > fastest:
                expected = f"at most {fastest:g}, twice guard.rate_limit_nm_per_s"
                yield Fault(f"{key}.slew_nm_per_s", expected, experiment.slew_nm_per_s)

    def _torque_rests(self) -> Iterator[tuple[float, str]]:
        """Largest base torque of both inverters that each limit leaves beside the PRBS [Nm], and its key."""
        parts_nm = self._prbs_parts_nm()
        yield self.guard.sum_limit_nm - self.prbs.amplitude_nm, "guard.sum_limit_nm"
        yield 2.0 * (self.inverters.m1.torque_limit_nm - parts_nm["m1"]), "inverters.m1.torque_limit_nm"
        yield 2.0 * (self.inverters.m2.torque_limit_nm - parts_nm["m2"]), "inverters.m2.torque_limit_nm"


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
        Naming every fault of the file, or of EDS and register map it names: line or key, expected, came.
    """
    file = Path(path)
    rig = validate(Rig, read_toml(file, RigFileError), file, RigFileError)
    for name, table in (("m1", rig.inverters.m1), ("m2", rig.inverters.m2)):
        if table.eds is not None:
            _require_eds(file, f"inverters.{name}.eds", table.eds, table.node_id)
    if rig.plc.map is not None:
        _require_map(rig.plc.map)
    return rig


def _require_eds(file: Path, key: str, eds: Path, node_id: int) -> None:
    """See that a rig's own EDS can be read; whether the drive agrees with it is for the drive to say."""
    try:
        EdsFile(eds, node_id)
    except ConfigMismatch as cause:
        raise RigFileError(file, f"{key} | expected an EDS | came: {cause}") from cause


def _require_map(path: Path) -> None:
    """See that a rig's own register map can be used, before anything is connected."""
    try:
        require_usable(load_register_map(path))
    except RegisterMapError as cause:
        raise RigFileError(path, *cause.problems) from cause
    except ConfigMismatch as cause:
        raise RigFileError(path, str(cause)) from cause
