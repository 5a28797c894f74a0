"""What the rig file says may be driven: its experiments by kind. A commissioning drives nothing beyond them."""

from __future__ import annotations

from typing import TypeVar

from hil.commission.order import Order, as_table
from hil.config.experiment_tables import AnyExperiment, CruiseTable
from hil.config.rig_file import Rig
from hil.errors import UsageError

Kind = TypeVar("Kind", bound=AnyExperiment)

HALT_S = 1.0
"""Recorded part of coming to a stand [s]."""


def first_of(rig: Rig, kind: type[Kind]) -> Kind | None:
    """Return the first experiment of a kind in a rig file; None without one."""
    return next((table for table in rig.experiments.values() if isinstance(table, kind)), None)


def cruise_of(rig: Rig) -> CruiseTable:
    """Return the cruise of a rig file: its speed is the one the vehicle is commissioned at.

    Raises
    ------
    UsageError
        If there is none.
    """
    table = first_of(rig, CruiseTable)
    if table is None:
        raise UsageError(
            f"rig {rig.name!r}: expected an experiment of kind 'cruise', which says at what speed and torque the "
            "vehicle may be driven, there is none. Add [experiments.cruise] to the rig file; see examples/rig.toml."
        )
    return table


def halt(rig: Rig) -> Order:
    """Order the vehicle to a stand, by the torque that brought it to speed."""
    table = as_table(cruise_of(rig), speed_rad_s=0.0, duration_s=HALT_S, prbs=False)
    return Order("halt", table, least_margin_rad_s=2.0)
