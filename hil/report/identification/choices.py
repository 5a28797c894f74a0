"""What a user leaves open, chosen from the data: order and delay; and estimators by their names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from estimator.identification.linear_model import Orders
from estimator.identification.offline.orders import OrderChoice, select_orders
from estimator.identification.online.ekf import TwoMass
from estimator.identification.online.registry import ESTIMATORS, Entry
from estimator.identification.settings import Settings
from estimator.physics.model import DrivelineModel, Structure
from estimator.signals.decimate import decimate
from estimator.signals.record import Record
from hil.errors import UsageError

AUTO: Final = "auto"

PHYSICAL: Final = "ekf"
"""The estimator whose states are physical parameters, which it can't start from nothing."""

ORDERS: Final = (2, 3, 4, 5, 6)
"""Tried for ``auto``: a two-mass drive has three."""

DELAYS: Final = (0, 1, 2, 3)
"""Tried for ``auto``. A low-pass ahead of the decimation spreads the torque over its neighbours to either side, so
that 0 may fit better than the one sample a held torque has."""

MOST_UNSEEN: Final = 3
"""Recordings the candidates are tried on besides the first, which they are fitted to."""


def chosen_orders(
    settings: Settings, order: str, delay: str, records: Sequence[Record]
) -> tuple[Settings, OrderChoice | None]:
    """Return the settings with order and delay filled in, and how they were chosen; None where both were given.

    Parameters
    ----------
    settings
        With the sampling period of the models.
    order, delay
        A number, or ``auto``.
    records
        The first is fitted, some of the others are what the candidates are tried on.

    Raises
    ------
    UsageError
        If one is neither a number in its range nor ``auto``.
    NotExciting
        If the data do not determine the richest candidate.
    """
    orders, delays = _numbers("--order", order, 1, ORDERS), _numbers("--delay", delay, 0, DELAYS)
    among = [Orders(n, n, nk) for nk in delays for n in orders]
    if len(among) == 1:
        return replace(settings, orders=among[0]), None
    first, *rest = (
        decimate(record, settings.factor(record), settings.high_pass_hz) for record in records[: MOST_UNSEEN + 1]
    )
    choice = select_orders(first, among, rest)
    return replace(settings, orders=choice.chosen), choice


def _numbers(option: str, text: str, least: int, all_of_them: Sequence[int]) -> Sequence[int]:
    if text == AUTO:
        return all_of_them
    if not (text.isascii() and text.isdigit()) or int(text) < least:
        raise UsageError(f"{option}: expected a whole number from {least} on, or {AUTO}, got {text!r}")
    return (int(text),)


def chosen_estimators(names: Sequence[str]) -> Mapping[str, Entry]:
    """Return what makes the recursive estimators of these names, each once.

    Raises
    ------
    UsageError
        If one is not known.
    """
    for name in names:
        if name not in ESTIMATORS:
            raise UsageError(f"--estimator: expected one of {', '.join(ESTIMATORS)}, got {name!r}")
    return {name: ESTIMATORS[name] for name in names}


def start_values(names: Sequence[str], expected: DrivelineModel | None) -> TwoMass | None:
    """Return the start values for an estimator of physical parameters: those of a two-mass model file.

    Raises
    ------
    UsageError
        If one of the estimators needs them and there are none.
    """
    if expected is not None and expected.structure is Structure.TWO_MASS:
        return TwoMass(**expected.values())
    if PHYSICAL in names:
        raise UsageError(
            f"--estimator {PHYSICAL}: expected start values for J_M, J_L, k and c, got none. Give a two-mass model "
            "file by --model; a factor of two off is near enough."
        )
    return None
