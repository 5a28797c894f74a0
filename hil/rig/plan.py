"""One run as it is planned, from the rig file alone: experiment, PRBS, shares, needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from drivers.plc.types import PrbsSource
from estimator.signals.multisine import Multisine
from estimator.signals.prbs import Prbs
from hil.config.experiment_tables import AnyExperiment
from hil.config.rig_file import Rig
from hil.rig.excitation import PlcPrbsOrder, Split, guarded_prbs
from hil.rig.experiments.base import Experiment, Phase
from hil.rig.experiments.registry import build_experiment, experiment_table
from hil.rig.plc_watch import Needs


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

    name: str  # which experiment, and the time between two cycles [s]
    period_s: float  # which experiment, and the time between two cycles [s]
    experiment: Experiment  # which experiment, and the time between two cycles [s]
    prbs: Levels  # the PRBS as the host makes it
    plc_prbs: PlcPrbsOrder | None  # what the PLC's own generator is sent
    split: Split  # shares of the two inverters
    needs: Needs  # what the run needs of the vehicle

    def prbs_nm(self, phase: Phase) -> float:
        """Next level of the PRBS the host sends [Nm]; it runs in the measured part only, and is zero outside it."""
        return self.prbs.next() if phase is Phase.MEASURE and self.plc_prbs is None else 0.0

    def expected_plc_prbs_nm(self, phase: Phase) -> float:
        """Next level that the PLC may add, to predict with [Nm]: its range is right, its course is the PLC's own."""
        return self.prbs.next() if phase is Phase.MEASURE and self.plc_prbs is not None else 0.0


def plan_run(rig: Rig, name: str) -> Plan:
    """Plan a run of one experiment of the rig file."""
    table = experiment_table(rig, name)
    split = Split(table.share_m1, rig.prbs.part_m1)
    largest = split.request(table.torque_nm, rig.excitation_nm(table))
    return Plan(
        name=name,
        period_s=rig.period_s,
        experiment=build_experiment(rig, name),
        prbs=_levels(rig, table),
        plc_prbs=_plc_prbs(rig, split) if table.prbs and rig.prbs.source is PrbsSource.PLC else None,
        split=split,
        needs=Needs(max(largest.total_m1_nm, largest.total_m2_nm)),
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
