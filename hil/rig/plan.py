"""One run as it is planned, from the rig file alone: experiment, PRBS, shares, needs."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.plc_types import PrbsSource
from estimator.signals.prbs import Prbs
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.rig.excitation import Split
from hil.rig.experiments.base import Experiment, Phase
from hil.rig.experiments.registry import build_experiment, experiment_table
from hil.rig.fitness import Needs

BASE_SHARE_M1 = 0.5
"""Both inverters give half of the base torque: they drive one shaft, and equal currents heat them equally."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What a run is made of. Experiment and PRBS have a state: a plan is for one run."""

    name: str
    period_s: float
    experiment: Experiment
    prbs: Prbs
    split: Split
    needs: Needs

    def prbs_nm(self, phase: Phase) -> float:
        """Next level of the PRBS [Nm]; it runs in the measured part only, and is zero outside it."""
        return self.prbs.next() if phase is Phase.MEASURE else 0.0


def plan_run(rig: Rig, name: str) -> Plan:
    """Plan a run of one experiment of the rig file.

    Raises
    ------
    UsageError
        If the rig file has no experiment of that name, or has the PRBS made by the PLC.
    """
    if rig.prbs.source is not PrbsSource.HOST:
        raise UsageError(
            f"rig {rig.name!r}: prbs.source is {rig.prbs.source.value!r}, expected 'host': a PRBS the PLC "
            'adds by itself would not pass the torque guard. Set source = "host" in [prbs].'
        )
    table = experiment_table(rig, name)
    split = Split(BASE_SHARE_M1, rig.prbs.part_m1)
    largest = split.request(table.torque_nm, rig.prbs.amplitude_nm)
    return Plan(
        name=name,
        period_s=rig.period_s,
        experiment=build_experiment(rig, name),
        prbs=Prbs(rig.prbs.amplitude_nm, rig.prbs.cells, rig.prbs.clock_divider, rig.prbs.seed),
        split=split,
        needs=Needs(max(largest.total_m1_nm, largest.total_m2_nm)),
    )
