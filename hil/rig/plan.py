"""One run as it is planned, from the rig file alone: experiment, PRBS, shares, needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from drivers.plc.types import PrbsSource
from estimator.signals.multisine import Multisine
from estimator.signals.prbs import Prbs
from hil.config.experiment_tables import AnyExperiment
from hil.config.guard_table import WithoutDamper
from hil.config.rig_file import Rig, torque_rests
from hil.errors import UsageError
from hil.rig.excitation import PlcPrbsOrder, Split, guarded_prbs
from hil.rig.experiments.base import Experiment, Phase
from hil.rig.experiments.registry import build_experiment, experiment_table
from hil.rig.plc_watch import Needs

if TYPE_CHECKING:  # it brings the estimator along
    from hil.rig.damper import Damping


class Levels(Protocol):
    """Where the levels of a PRBS or multi-sine come from, one per cycle."""

    def next(self) -> float:
        """Level of this cycle [Nm]."""
        ...


class NoPrbs:
    """The levels of an experiment without a PRBS."""

    def next(self) -> float:
        """Zero [Nm]."""
        return 0.0


@dataclass(frozen=True, slots=True)
class Plan:
    """What a run is made of. Experiment and PRBS have a state: a plan is for one run."""

    name: str  # of the experiment: NAME of [experiments.NAME]
    period_s: float  # time between two cycles [s]
    experiment: Experiment  # its base torque, in phases
    prbs: Levels  # the PRBS as the host makes it
    plc_prbs: PlcPrbsOrder | None  # what the PLC's own generator is sent
    split: Split  # shares of the two inverters
    needs: Needs  # what the run needs of the vehicle
    damper: Damping | None = None  # active damping in the measured part

    def prbs_nm(self, phase: Phase) -> float:
        """Next level of the PRBS the host sends [Nm]; it runs in the measured part only, and is zero outside it."""
        return self.prbs.next() if phase is Phase.MEASURE and self.plc_prbs is None else 0.0

    def damping_nm(self, phase: Phase, cycle: int) -> float:
        """Return the torque of the damper [Nm]; it acts in the measured part only."""
        return self.damper.torque_nm(cycle) if self.damper is not None and phase is Phase.MEASURE else 0.0

    def expected_plc_prbs_nm(self, phase: Phase) -> float:
        """Next level that the PLC may add, to predict with [Nm]: its range is right, its course is the PLC's own."""
        return self.prbs.next() if phase is Phase.MEASURE and self.plc_prbs is not None else 0.0


def plan_run(rig: Rig, name: str, damper: Damping | None = None) -> Plan:
    """Plan a run of one experiment of the rig file, with a damper where one is given."""
    table = experiment_table(rig, name)
    split = Split(table.share_m1, rig.prbs.part_m1)
    excitation_nm = rig.excitation_nm(table)
    if damper is not None:
        _require_fit(rig, table, split, damper)
        excitation_nm += damper.rig.limit_nm
        damper.ends_run = rig.guard.without_damper is WithoutDamper.END
    largest = split.request(table.torque_nm, excitation_nm)
    return Plan(
        name=name,
        period_s=rig.period_s,
        experiment=build_experiment(rig, name),
        prbs=_levels(rig, table),
        plc_prbs=_plc_prbs(rig, split) if table.prbs and rig.prbs.source is PrbsSource.PLC else None,
        split=split,
        needs=Needs(max(largest.total_m1_nm, largest.total_m2_nm)),
        damper=damper,
    )


def _require_fit(rig: Rig, table: AnyExperiment, split: Split, damper: Damping) -> None:
    """See that a damper was designed for this rig, and that guard and inverters leave it the torque it may ask for."""
    here = {"period_s": rig.period_s, **damper.rig.of(rig, damper.rig.limit_nm).model_dump()}
    for name, expected in {"period_s": damper.file.period_s, **damper.rig.model_dump()}.items():
        if here[name] != expected:
            raise UsageError(
                f"--damper: {name} of the rig is {here[name]!r}, expected {expected!r}, for which it was designed. "
                "Design it anew with --rig."
            )
    if not table.prbs or rig.prbs.source is PrbsSource.PLC:
        raise UsageError(
            "--damper: expected an experiment with the host's PRBS (prbs.source = 'host'), which measures the closed "
            "loop and supervises it, got one without. Choose another experiment."
        )
    both_nm = rig.excitation_nm(table) + damper.rig.limit_nm
    most_nm = rig.guard.prbs_limit_nm / max(split.prbs_m1, 1.0 - split.prbs_m1)
    rests = torque_rests(rig, table.share_m1, both_nm)
    of_torque = (("the base torque", table.torque_nm, rest_nm, f"{of} next to both") for rest_nm, of in rests)
    for what, asked_nm, rest_nm, of in (("PRBS and damper", both_nm, most_nm, "guard.prbs_limit_nm"), *of_torque):
        if asked_nm > rest_nm:
            raise UsageError(
                f"--damper: {what} may come to {asked_nm:g} Nm, expected at most {rest_nm:g} Nm, which {of} leaves. "
                "Lower torque_nm or prbs_amplitude_nm of the experiment, or design with less --share."
            )


def _levels(rig: Rig, table: AnyExperiment) -> Levels:
    if not table.prbs:
        return NoPrbs()
    if table.multisine is not None:
        return Multisine(table.multisine.levels_nm(rig.period_s))
    divider = table.prbs_clock_divider or rig.prbs.clock_divider
    return Prbs(rig.excitation_nm(table), rig.prbs.cells, divider, rig.prbs.seed)


def _plc_prbs(rig: Rig, split: Split) -> PlcPrbsOrder:
    m1, m2 = guarded_prbs(rig.torque_limits, split, rig.prbs.amplitude_nm)
    return PlcPrbsOrder(m1, m2, rig.prbs.clock_divider, rig.prbs.seed)
