"""Whether torque, output and time are in the units of the model: the inertia that fits says so.

A fit would put all of a wrong unit into its parameters and what is left into effects, and a verdict on it would be
about the unit. An inertia far outside its tolerance is believed where the motion follows from the torque by it; then it
is no missing physics but a factor. A torque that stops at a limit or is lost over time is no factor, and left to the
diagnosis.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.preconditions.factors import known_factors
from estimator.diagnosis.preconditions.inertia import Inertia, fitted_inertia
from estimator.errors import BadModel, Implausible
from estimator.physics.grid import grid_for
from estimator.physics.model import DrivelineModel, Motion, parameter_unit
from estimator.signals.record import FloatArray, OutputKind, Record

BEYOND = 2.5
"""Factor beyond an inertia's tolerance that is implausible: payloads, derating and closed clutches are less, the
smallest factor between units (3.6) is more."""

SLOWEST_S = 0.5
"""A driveline sampled slower than this is more likely recorded in another unit of time."""

CLEARLY = 0.5
"""Share of the unexplained motion that a torque turned round may leave: a mere factor is the simpler answer."""

NAMED = 2
"""Known factors that a message names."""

LIMITS = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.07, 0.05)
"""Limits of a torque that are tried, in its largest reading: what is read beyond is not there."""

DEPTHS, TIMES = (0.5, 0.8, 0.95), (0.05, 0.3, 1.0)
"""Losses of a torque over time that are tried, and their time constants in the recording's length."""

UNKNOWN = "No common unit is off by this; is one of several torques counted with the wrong sign?"


def require_plausible_units(records: Sequence[Record], model: DrivelineModel) -> None:
    """Refuse recordings whose torque, output or time is off by a factor or in sign.

    Raises
    ------
    Implausible
        With the factor, and the units that it is close to.
    """
    line = replace(model, effects={})
    for record in records:
        if record.kind is OutputKind.FORCE:
            continue
        found = _inertia(record, line)
        if found is not None and _is_plausible(found, line):
            continue
        _ask_for_more_than_a_factor(record, line, found)
        if found is not None and not _is_of_the_torque_path(record, line, found):
            raise Implausible(_statement(record, line, found))


def _ask_for_more_than_a_factor(record: Record, line: DrivelineModel, found: Inertia | None) -> None:
    """Refuse a recording that is plausible but for its unit of time, or for the sign of one of its torques."""
    if record.sample_time_s >= SLOWEST_S:
        shorter = 1e-3 * record.sample_time_s
        other = _inertia(replace(record, sample_time_s=shorter, time_s=1e-3 * record.time_s), line)
        if other is not None and _is_plausible(other, line):
            raise Implausible(
                f"recording {record.name} is implausible: its sampling period is {record.sample_time_s:g} s, and with "
                f"{shorter:g} s it fits the nominal inertia. Is time in ms, expected s? Give time its scale in "
                "[signals]."
            )
    unexplained = 1.0 if found is None else 1.0 - found.share
    for i in range(record.torque_nm.shape[1] if record.torque_nm.shape[1] > 1 else 0):
        turned = record.torque_nm.copy()
        turned[:, i] *= -1.0
        other = _inertia(replace(record, torque_nm=turned), line)
        if other is not None and _is_plausible(other, line) and 1.0 - other.share < CLEARLY * unexplained:
            raise Implausible(
                f"recording {record.name} is implausible: it fits the nominal inertia only with the sign of torque "
                f"input {i + 1} turned round. All torques count positive in the direction of the speed: give that "
                "column a negative scale in [signals]."
            )


def _is_of_the_torque_path(record: Record, line: DrivelineModel, found: Inertia) -> bool:
    """Tell whether a torque that stops at a limit, or is lost over time, explains more than a factor does.

    Either makes an inertia look too large, and is an entry of the catalogue: not to be refused but to be found.
    """
    if found.ratio < 0.0:
        return False
    others = (_inertia(replace(record, torque_nm=torque), line) for torque in _lessened(record))
    rest = CLEARLY * (1.0 - found.share)
    return any(each is not None and _is_plausible(each, line) and 1.0 - each.share < rest for each in others)


def _lessened(record: Record) -> Iterable[FloatArray]:
    """Yield the torques that a path with limits, or with a loss over time, would let through, shape (N, M)."""
    read, count = record.torque_nm, record.torque_nm.shape[1]
    most = np.abs(read).max(axis=0)
    for share in LIMITS:
        for inputs in [range(count), *([i] for i in range(count if count > 1 else 0))]:
            limit = np.where(np.isin(np.arange(count), list(inputs)), share * most, np.inf)
            yield np.clip(read, -limit, limit)
    since = record.since_start_s[:, np.newaxis]
    for depth in DEPTHS:
        for time in TIMES:
            yield read * (1.0 - depth * (1.0 - np.exp(-since / (time * since[-1]))))


def _inertia(record: Record, line: DrivelineModel) -> Inertia | None:
    """Return the inertia that a recording fits; only as one body where the line's modes can't be simulated with it."""
    try:
        grid = grid_for(line, [record])
    except BadModel:
        grid = None
    return fitted_inertia(record, line, grid)


def _is_plausible(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning, or of physics missing."""
    tolerance = max(parameter.tolerance for name, parameter in line.parameters.items() if name.startswith("J"))
    return (1.0 - tolerance) / BEYOND <= found.ratio <= (1.0 + tolerance) * BEYOND


def _statement(record: Record, line: DrivelineModel, found: Inertia) -> str:
    names = [name for name in line.parameters if name.startswith("J")]
    total = sum(line.parameters[name].value for name in names)
    nominal = f"{' + '.join(names)} = {total:g} {parameter_unit(names[0], line.motion)}"
    if found.ratio < 0.0:
        torque = "torque" if line.motion is Motion.ROTATION else "force"
        return (
            f"recording {record.name} is implausible: the output falls where the {torque} rises (an inertia "
            f"{found.ratio:.3g} times the nominal {nominal} fits). Is the sign of {torque} or output turned round? "
            "Give one of them a negative scale in [signals]."
        )
    close = " ".join(f"This is close to {known}" for known in known_factors(found.ratio, line.gear_ratio)[:NAMED])
    return (
        f"recording {record.name} is implausible: it fits an inertia {found.ratio:.3g} times the nominal {nominal}, "
        f"expected 1 within its tolerance and a factor of {BEYOND:g}. {close or UNKNOWN} "
        "Correct the scale in [signals] (a torque in per cent of a rated one needs one, too), or the inertia in the "
        "model file."
    )
