"""From a table of the rig file to the experiment it describes: a new kind is one law and one case here."""

from __future__ import annotations

from hil.config.experiment_tables import (
    AnyExperiment,
    CoastTable,
    CruiseTable,
    DrivenTable,
    PulsesTable,
    RampTable,
    RestTable,
    ReversalTable,
    TipTable,
)
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.rig.experiments.base import Experiment, MeasureLaw
from hil.rig.experiments.laws import Coast, Cruise, Pulses, Ramp, Rest, Reversal, Tip
from hil.rig.experiments.open_loop import MOVING_RAD_S, OpenLoop
from hil.rig.experiments.staged import Approach, StagedExperiment, TorqueBounds


def experiment_table(rig: Rig, name: str) -> AnyExperiment:
    """Look an experiment of the rig file up by name."""
    table = rig.experiments.get(name)
    if table is None:
        known = ", ".join(sorted(rig.experiments)) or "none"
        raise UsageError(
            f"experiment {name!r}: expected one of rig {rig.name!r} ({known}). "
            f"Name one of these, or add [experiments.{name}] to the rig file."
        )
    return table


def build_experiment(rig: Rig, name: str) -> Experiment:
    """Build a fresh experiment; each run needs its own."""
    table = experiment_table(rig, name)
    match table:
        case PulsesTable():
            course = Pulses(table.duration_s, table.step_nm, table.step_s)
            return OpenLoop(course, table.slew_nm_per_s, table.most_speed_rad_s, rig.period_s)
        case RestTable():
            return OpenLoop(Rest(table.duration_s), 0.0, MOVING_RAD_S, rig.period_s)
    return _staged(rig, table)


def _staged(rig: Rig, table: DrivenTable) -> Experiment:
    """Build an experiment that is led up to by a speed control."""
    law = _law(table, rig.vehicle.inertia_kg_m2, rig.period_s)
    approach = Approach(
        speed_rad_s=law.start_speed_rad_s,
        inertia_kg_m2=rig.vehicle.inertia_kg_m2,
        torque_limit_nm=table.torque_nm,
        period_s=rig.period_s,
        timeout_s=table.approach_timeout_s,
    )
    return StagedExperiment(law, approach, TorqueBounds(table.torque_nm, table.slew_nm_per_s), rig.period_s)


def _law(table: DrivenTable, inertia_kg_m2: float, period_s: float) -> MeasureLaw:
    match table:
        case CruiseTable():
            return Cruise(table.speed_rad_s, table.duration_s, inertia_kg_m2, table.torque_nm, period_s)
        case ReversalTable():
            return Reversal(0.0, table.duration_s, table.turning_speed_rad_s, table.swing_nm, period_s)
        case TipTable():
            return Tip(table.speed_rad_s, table.duration_s, table.step_nm, table.step_s)
        case CoastTable():
            return Coast(table.speed_rad_s, table.duration_s)
        case RampTable():
            return Ramp(0.0, table.duration_s, table.swing_nm, table.ramp_s)
