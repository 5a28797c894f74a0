"""From a table to the estimator's ``Record``, by the contract's columns or by ``[signals]`` of a model file.

A row is a missing sample (``okay`` False) where torque or output is NaN, where the rig flagged it, or where a
mask says so. Time advances there, so the simulation needs a torque: the last good value is held where the
reading is not to be trusted (NaN, flagged, outside a mask on that very column). A mask on another column says
that the model does not hold there, not that the torque was misread; the torque stays as recorded.

``torque_okay`` tells only what the acquisition lost (NaN, flagged). Rows that a mask takes out are the choice of
whoever wrote the model file, and no fault of the acquisition that a diagnosis could find.

Inputs of which one counts twice, or that take one another away, are refused last. What else a channel says against its
role is asked of the `Record`, by ``estimator.diagnosis.preconditions``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimator.signals.record import Channel, Location, OutputKind, Record
from hil.errors import RecordingError
from hil.recording import columns
from hil.recording.formats import read_table
from hil.recording.resample import Series, resampled, time_base
from hil.recording.scales import Role, scale_of, unit_of, with_sign, wrapped_at
from hil.recording.signals_config import (
    LoadSignal,
    MaskRange,
    MeasuredOutput,
    OutputSignal,
    SignalsConfig,
    TimeSignal,
    TorqueSignal,
)
from hil.recording.survey import looks_like_torque
from hil.recording.table import FloatArray, Table

SMALLEST, GREATEST = 1e-15, 1e15
"""Between them is the largest value of any signal of a drive, in SI units; their squares and products are numbers."""

SHORTEST_S, LONGEST_S = 1e-9, 1e6  # between them is a sampling period
SAME_PERIOD = 1e-6  # share by which the steps of a recording may differ from a period it is said to have

FEWEST_SAMPLES = 10
"""A recording with fewer usable samples can't carry a constant load, an initial state and anything next to."""


Tell = Callable[[str], None]  # takes one line of what was recognised, left out or fixed

CANCELS: Final = 0.01
"""Ratio of the spread of a sum of torques to theirs below which they cancel: two readings differ by more."""

FOLLOWS: Final = 0.3
"""Correlation of a torque's impulse with the change of the speed from which on one follows the other."""


def read_record(
    path: Path | str,
    signals: SignalsConfig | None = None,
    on_bench: bool = False,
    dbc: Path | None = None,
    tell: Tell | None = None,
) -> Record:
    """Read a recording as the estimator takes it.

    Parameters
    ----------
    path : Path or str
        The recording; its stem names it.
    signals : SignalsConfig, optional
        Of the model file; the contract's columns without it.
    on_bench : bool
        Whether the model is a joint on a bench: the position is imposed, and the torque it takes is the output.
    dbc : Path, optional
        What the frames of a logged CAN bus mean.
    tell : callable, optional
        Called with what was recognised in the file, and what was done to it.

    Returns
    -------
    Record
        One sample per row of the file.

    Raises
    ------
    RecordingError
        If the file is at fault, with every fault of a kind, by name and line.
    """
    signals = signals or SignalsConfig()
    record = to_record(read_table(path, signals.request(dbc)), signals, tell)
    return under_imposed_motion(record) if on_bench else record


def to_record(table: Table, signals: SignalsConfig, tell: Tell | None = None) -> Record:
    """Pick the signals out of a table; see :func:`read_record`."""
    signals = signals.model_copy(update={"time": time_signal(table, signals.time)})
    table, inside = _cut(at_one_period(table, signals), signals)
    torques = signals.torques()
    kind, output = signals.output()
    numbers = table.numeric([*([] if signals.time.column is None else [signals.time.column]), *signals.columns()])
    time_s, period_s, remark = time_base(table, signals.time)
    scales = [scale_of(table, torque.column, Role.TORQUE, torque.given_scale) for torque in torques]
    scale = scale_of(table, output.column, Role(kind.value), output.given_scale)
    further = signals.further()
    signed: list[TorqueSignal | LoadSignal | OutputSignal] = [*signals.inputs(), output, *further]
    for signal in signed:
        numbers[signal.column] = _signed(table, signal, numbers[signal.column])
    names = [torque.column for torque in torques]
    largest = max(map(abs, scales))
    acting = {
        torque.column: numbers[torque.column] * (by / largest) for torque, by in zip(torques, scales, strict=True)
    }
    speed = math.copysign(1.0, scale) * numbers[output.column] if kind is OutputKind.SPEED else None
    require_plausible_torques(table, names, acting, speed)
    if tell is not None:
        for line in (*table.recognised, *remark, *_units_used(table, signals)):
            tell(f"{table.path}: {line}")
    masks = {mask: in_mask(numbers[mask.column], mask) for mask in signals.mask}
    flagged = _flagged(table, signals)
    read = np.column_stack([np.isfinite(numbers[torque.column]) & ~flagged for torque in torques])
    trusted = read & np.column_stack([_inside_own(numbers[torque.column], torque.column, masks) for torque in torques])
    with np.errstate(over="ignore"):  # what is too large then is refused
        torque_nm = np.column_stack([numbers[torque.column] * by for torque, by in zip(torques, scales, strict=True)])
        measured = numbers[output.column] * scale
        channels = [_channel(table, each, numbers[each.column]) for each in further]
        load_nm, load_read = _load(table, signals, numbers)
    counted = trusted.all(axis=1) & load_read & np.logical_and.reduce([~flagged, inside, *masks.values()])
    okay = counted & np.isfinite(measured)
    _require_sizes(
        table, [*((torque.column, torque_nm[:, k]) for k, torque in enumerate(torques)), (output.column, measured)]
    )
    _require_sizes(table, [(channel.label, channel.output) for channel in channels])
    _require_period(table, period_s)
    _require_samples(table, okay)
    return Record(
        name=table.path.stem,
        sample_time_s=period_s,
        time_s=time_s,
        torque_nm=_held(torque_nm, trusted),
        output=measured,
        okay=okay,
        kind=kind,
        location=output.at,
        torque_okay=None if read.all() else read,
        reference_nm=_reference(table, signals),
        load_nm=load_nm,
        channels=tuple(channels),
        inputs=() if signals.is_own_recording else tuple(names),
        unused=() if signals.is_own_recording else tuple(_unused(table, signals)),
    )


def _unused(table: Table, signals: SignalsConfig) -> Iterator[Channel]:
    """Yield the columns that look like torques, that move, and that no signal names."""
    named = {*signals.columns(), signals.time.column}
    for name, column in table.columns.items():
        unit = table.units.get(name, "")
        if name not in named and looks_like_torque(name, column, unit):
            known = unit_of(unit)
            values = table.numeric([name])[name] * (1.0 if known is None else known.factor)
            read = np.isfinite(values)
            held = _held(values[:, np.newaxis], read[:, np.newaxis])[:, 0]
            yield Channel(OutputKind.TORQUE, Location.MOTOR, name, held, read)


def _cut(table: Table, signals: SignalsConfig) -> tuple[Table, NDArray[np.bool_]]:
    """Return a table from the first to the last row of the stretches that are to be read, and which rows are in one."""
    kept = signals.stretches_read()
    if not kept:
        return table, np.ones(table.n_rows, dtype=np.bool_)
    time_s, _, _ = time_base(table, signals.time)
    inside = np.logical_or.reduce([(time_s >= start) & (time_s <= end) for start, end in kept])
    if not inside.any():
        raise RecordingError(
            table.path,
            f"expected rows in the stretch that [signals] names, got none: the recording is from {time_s[0]:g} to "
            f"{time_s[-1]:g} s",
        )
    rows = slice(int(np.argmax(inside)), int(inside.size - np.argmax(inside[::-1])))
    first_line = None if table.first_line is None else table.first_line + rows.start
    columns = {name: column[rows] for name, column in table.columns.items()}
    return replace(table, columns=columns, first_line=first_line), inside[rows]


def _load(
    table: Table, signals: SignalsConfig, numbers: Mapping[str, FloatArray]
) -> tuple[FloatArray | None, NDArray[np.bool_]]:
    """Return the measured torque of a load machine, held where it was not read, and where it was."""
    signal = signals.load
    if signal is None:
        return None, np.ones(table.n_rows, dtype=np.bool_)
    measured = numbers[signal.column] * scale_of(table, signal.column, Role.TORQUE, signal.given_scale)
    read = np.isfinite(measured)
    if not read.any():
        raise RecordingError(table.path, f"column {signal.column}: expected a load torque, got no number at all.")
    _require_sizes(table, [(signal.column, measured)])
    return _held(measured[:, np.newaxis], read[:, np.newaxis])[:, 0], read


def _channel(table: Table, signal: MeasuredOutput, values: FloatArray) -> Channel:
    """Return a further measured output; where it was not read, it counts for nothing."""
    measured = values * scale_of(table, signal.column, Role(signal.kind.value), signal.given_scale)
    return Channel(signal.kind, signal.at, signal.column, measured, np.isfinite(measured))


def _signed(table: Table, signal: TorqueSignal | LoadSignal | OutputSignal, values: FloatArray) -> FloatArray:
    """Return a reading with its sign."""
    if signal.wraps_at is not None:
        return with_sign(values, signal.wraps_at)
    end = wrapped_at(values)
    if end is not None:
        scale = "" if signal.given_scale is None else f", scale = {signal.scale:g}"
        line = f"{{ column = {signal.column!r}{scale}, wraps_at = {end:g} }}"
        raise RecordingError(
            table.path,
            f"column {signal.column}: expected a reading with a sign, got one that jumps between 0 and {end:g}: it "
            f"was stored with a sign and read without. Write {line}.",
        )
    return values


def _units_used(table: Table, signals: SignalsConfig) -> Iterator[str]:
    """Say which columns were brought to SI units by the units that the file gives them."""
    kind, output = signals.output()
    roles: list[tuple[TorqueSignal | LoadSignal | OutputSignal, Role]] = [
        (torque, Role.TORQUE) for torque in signals.inputs()
    ]
    roles += [(output, Role(kind.value)), *((each, Role(each.kind.value)) for each in signals.further())]
    for signal, role in roles:
        factor = scale_of(table, signal.column, role, signal.given_scale)
        if signal.given_scale is None and factor != 1.0:
            yield f"{signal.column}: read in {table.units[signal.column]}, times {factor:.6g}"


def time_signal(table: Table, time: TimeSignal) -> TimeSignal:
    """Return the time to read: the file's own master channel, where it has none of the name given."""
    if time.column is None or time.column in table.columns or table.master is None:
        return time
    return time.model_copy(update={"column": table.master})


def at_one_period(table: Table, signals: SignalsConfig) -> Table:
    """Bring a table of uneven rate to the period that was asked for; one that has it already stays as it is."""
    period_s, column = signals.resample_s, signals.time.column
    if period_s is None or column is None:
        return table
    numbers = table.numeric([column, *signals.columns()])
    time = numbers.pop(column) * scale_of(table, column, Role.TIME, signals.time.given_scale)
    if time.size > 1 and np.allclose(np.diff(time), period_s, rtol=SAME_PERIOD, atol=0.0):
        return table
    held = signals.held()
    series = {name: Series(time, values, name in held) for name, values in numbers.items()}
    raster, columns, remarks = resampled(table.path, series, period_s)
    return replace(
        table,
        columns={column: raster, **columns},
        units={**table.units, column: "s"},
        remarks=(*table.remarks, *remarks),
        first_line=None,
    )


def under_imposed_motion(record: Record) -> Record:
    """Return a recording of torque and position as that of a joint: the position imposed, the torque its answer.

    Across missing samples the motion is bridged by a straight line; a torque that was not read is only not compared.
    """
    good = np.flatnonzero(record.okay)
    return replace(
        record,
        output=record.total_torque_nm,
        kind=OutputKind.FORCE,
        imposed=np.interp(record.time_s, record.time_s[good], record.output[good]),
        torque_okay=None,
        channels=(),
    )


def in_mask(values: FloatArray, mask: MaskRange) -> NDArray[np.bool_]:
    """Tell of each row whether a mask lets it count; both shapes (N,)."""
    low = -np.inf if mask.min is None else mask.min
    high = np.inf if mask.max is None else mask.max
    counts: NDArray[np.bool_] = (values >= low) & (values <= high)  # NaN is outside
    return counts


def _flagged(table: Table, signals: SignalsConfig) -> NDArray[np.bool_]:
    if not (signals.is_own_recording and columns.FLAGS in table.columns):
        return np.zeros(table.n_rows, dtype=np.bool_)
    flagged: NDArray[np.bool_] = ~np.isin(table.numeric([columns.FLAGS])[columns.FLAGS], columns.COUNTING_FLAGS)
    return flagged


def _reference(table: Table, signals: SignalsConfig) -> FloatArray | None:
    """Return the torque that was asked for, where a recording of the rig has it; NaN where it doesn't."""
    if not (signals.is_own_recording and columns.REFERENCE in table.columns):
        return None
    return table.numeric([columns.REFERENCE])[columns.REFERENCE]


def _inside_own(values: FloatArray, column: str, masks: dict[MaskRange, NDArray[np.bool_]]) -> NDArray[np.bool_]:
    own = [inside for mask, inside in masks.items() if mask.column == column]
    inside: NDArray[np.bool_] = np.logical_and.reduce([np.ones(values.shape, dtype=np.bool_), *own])
    return inside


def _held(torque_nm: FloatArray, trusted: NDArray[np.bool_]) -> FloatArray:
    """Replace what is not trusted by the last value that is, at the start by the first; all shapes (N, M)."""
    rows = np.where(trusted, np.arange(torque_nm.shape[0])[:, np.newaxis], -1)
    last = np.maximum.accumulate(rows, axis=0)
    first = np.argmax(trusted, axis=0)
    held: FloatArray = np.take_along_axis(torque_nm, np.where(last < 0, first, last), axis=0)
    return held


def _require_sizes(table: Table, signals: Iterable[tuple[str, FloatArray]]) -> None:
    """Refuse signals that no drive has, whatever it is: what is computed from them would be no numbers."""
    problems = []
    for name, values in signals:
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        if largest != 0.0 and not SMALLEST <= largest <= GREATEST:
            problems.append(
                f"column {name}: expected a signal in SI units, the largest value between {SMALLEST:g} and "
                f"{GREATEST:g}, got {largest:g}. Check its unit, and its scale in [signals]"
            )
    if problems:
        raise RecordingError(table.path, *problems)


def _require_period(table: Table, period_s: float) -> None:
    if not SHORTEST_S <= period_s <= LONGEST_S:
        raise RecordingError(
            table.path,
            f"expected a sampling period between {SHORTEST_S:g} and {LONGEST_S:g} s, got {period_s:g} s. Check the "
            "unit of its time, and its scale in [signals]",
        )


def _require_samples(table: Table, okay: NDArray[np.bool_]) -> None:
    usable = int(okay.sum())
    if usable < FEWEST_SAMPLES:
        raise RecordingError(
            table.path,
            f"expected {FEWEST_SAMPLES} usable samples or more, got {usable} of {okay.size} rows "
            "(the others are nan, flagged or masked). Record longer or fix the mask.",
        )


def require_plausible_torques(
    table: Table, names: Sequence[str], values: Mapping[str, FloatArray], speed: FloatArray | None = None
) -> None:
    """Refuse inputs of which one counts twice, or that take one another away; the speed tells which one is turned."""
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise RecordingError(
            table.path,
            f"column {twice}: expected every torque once, got it twice in [signals] torque: it would count double. "
            "Name the other inverter's column, or leave one out and give scale = 2.",
        )
    both = np.column_stack([values[name] for name in names])
    both = both[np.isfinite(both).all(axis=1)]
    if len(names) == 2 and both.size and both.std(axis=0).min() > 0.0:
        total = both.sum(axis=1)
        if max(float(total.std()), abs(float(total.mean()))) < CANCELS * both.std(axis=0).min():
            alike = 0.0 if speed is None else _drives(values[names[0]], speed)
            turned = names[alike > 0.0] if abs(alike) > FOLLOWS else ""
            cure = f"write {{ column = {turned!r}, scale = -1.0 }}" if turned else "give the one that is scale = -1.0"
            raise RecordingError(
                table.path,
                f"columns {names[0]} and {names[1]}: expected torques that add up, got two that cancel in every row. "
                f"One is turned round: {cure}.",
            )


def _drives(torque: FloatArray, speed: FloatArray) -> float:
    """Return how much a speed changes with the impulse of a torque, less its friction: a correlation, or 0."""
    width = max(1, speed.size // 20)
    impulse = np.concatenate([[0.0], np.cumsum(np.nan_to_num(torque))])
    pair = np.column_stack([impulse[width:-1] - impulse[: -width - 1], speed[width:] - speed[:-width]])
    read = np.isfinite(pair).all(axis=1)
    rubs = np.column_stack([0.5 * (speed[width:] + speed[:-width]), np.ones(read.size)])[read]
    pair = pair[read] - rubs @ np.linalg.lstsq(rubs, pair[read], rcond=None)[0]
    size = float(np.prod(np.linalg.norm(pair, axis=0)))
    return float(pair[:, 0] @ pair[:, 1]) / size if size else 0.0
