"""Stale samples: a reading that was not renewed in time and repeats the one before, without a flag."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from estimator.diagnosis.acquisition.finding import OUTPUT, Finding, Sized, no_cells
from estimator.diagnosis.acquisition.late_torque import LateTorque, late_torque, pooled_p_value
from estimator.diagnosis.acquisition.lattice import lattice_step, repeats
from estimator.diagnosis.acquisition.limits import LEVEL, SMALLEST_P, SMALLEST_SHARE
from estimator.diagnosis.acquisition.readings import channels, flagged, mean_run, share_interval
from estimator.diagnosis.acquisition.repeated import Repeated, repeated
from estimator.signals.record import BoolArray, Record

Cells = dict[str, BoolArray]
Size = tuple[float, tuple[float, float], float]
"""Share of stale samples, its 95 % interval, and the probability of as many by chance."""


def stale_samples(records: Sequence[Record]) -> Finding | None:
    """Recognise readings that repeat the one before, in any channel; None where chance explains the repeats."""
    cells = {record.name: no_cells(record) for record in records}
    sizes: dict[str, Size] = {}
    output = _of_output(records, cells)
    if output is not None:
        sizes[records[0].kind.value] = output
    sizes |= _of_torques(records, cells)
    if not sizes:
        return None
    value, ci95, _ = max(sizes.values())
    return Finding(
        name="stale_samples",
        parameters={"share": Sized(value, ci95, "")},
        cells=cells,
        p_value=max(min(size[2] for size in sizes.values()), SMALLEST_P),
        statement=_statement(value, tuple(sizes), records),
    )


def _statement(share: float, names: tuple[str, ...], records: Sequence[Record]) -> str:
    inputs = max(record.torque_nm.shape[1] for record in records)
    where = "whole rows" if len(names) == 1 + inputs else " and ".join(names)
    return f"{100.0 * share:.2g}% of the samples are stale: the previous value is repeated without a flag in {where}"


def _of_output(records: Sequence[Record], cells: Cells) -> Size | None:
    read = [np.where(flagged(record), np.nan, record.output) for record in records]
    found = repeated(read)
    size = _size(found)
    if size is not None:
        for record, rows in zip(records, found.rows, strict=True):
            cells[record.name][:, OUTPUT] = rows
    return size


def _size(found: Repeated) -> Size | None:
    if not found.is_stale:
        return None
    low, high = share_interval(found.count, found.total, mean_run(list(found.rows)))
    ci95 = (found.share(low * found.total), found.share(high * found.total))
    return found.share(found.count), ci95, found.p_value


def _of_torques(records: Sequence[Record], cells: Cells) -> dict[str, Size]:
    """Look at every torque input: with the output, by the output's answer, or by its own repeats, whichever tells."""
    sizes: dict[str, Size] = {}
    every = tuple(range(min(record.torque_nm.shape[1] for record in records)))
    for i in every:
        size = _with_output(records, i, cells)
        if size is not None:
            sizes[f"torque {i + 1}"] = size
    left = tuple(i for i in every if f"torque {i + 1}" not in sizes)
    together = _by_answer(records, left, cells) if len(left) > 1 else None
    for i in left:
        size = together or _by_answer(records, (i,), cells) or _by_itself(records, i, cells)
        if size is not None:
            sizes[f"torque {i + 1}"] = size
    return sizes


def _with_output(records: Sequence[Record], i: int, cells: Cells) -> Size | None:
    """Tell whether a torque repeats in the output's stale rows more often than in others."""
    stale, fresh = [], []
    again = [_torque_repeats(record, i) for record in records]
    for record, repeat in zip(records, again, strict=True):
        rows, read = cells[record.name][:, OUTPUT], record.torque_trusted[:, i]
        stale.append(repeat[rows & read])
        fresh.append(repeat[~rows & read])
    joint, others = np.concatenate(stale), np.concatenate(fresh)
    if joint.size == 0:
        return None
    usual = (float(others.sum()) + 1.0) / (others.size + 2.0)
    p_value = float(stats.binom.sf(int(joint.sum()) - 1, joint.size, usual))
    share = float(joint.sum()) / sum(record.okay.size for record in records)
    if not (p_value <= LEVEL and share >= SMALLEST_SHARE):
        return None
    for record, repeat in zip(records, again, strict=True):
        cells[record.name][:, 1 + i] = repeat & cells[record.name][:, OUTPUT]
    rows_of = [cells[record.name][:, 1 + i] for record in records]
    total = sum(record.okay.size for record in records)
    return share, share_interval(float(joint.sum()), total, mean_run(rows_of)), p_value


def _torque_repeats(record: Record, i: int) -> BoolArray:
    values = channels(record)[:, 1 + i]
    return repeats(values, lattice_step(values))


def _by_itself(records: Sequence[Record], i: int, cells: Cells) -> Size | None:
    """Tell by the repeats alone, as for the output; possible where the torque's noise is well above its resolution."""
    found = repeated([channels(record)[:, 1 + i] for record in records])
    size = _size(found)
    if size is not None:
        for record, rows in zip(records, found.rows, strict=True):
            cells[record.name][:, 1 + i] = rows
    return size


def _by_answer(records: Sequence[Record], inputs: tuple[int, ...], cells: Cells) -> Size | None:
    """Tell by the output's answer to steps that are recorded late."""
    found: dict[str, LateTorque] = {}
    for record in records:
        trusted = record.okay & np.isfinite(record.output) & ~cells[record.name][:, OUTPUT]
        late = late_torque(record, inputs, trusted)
        if late is not None:
            found[record.name] = late
    steps = sum(late.repeats + late.others for late in found.values())
    count = sum(late.early for late in found.values())
    p_value = pooled_p_value(list(found.values()))
    if not (count >= SMALLEST_SHARE * max(steps, 1) and p_value <= LEVEL):
        return None
    for name, late in found.items():
        for i in inputs:
            cells[name][:, 1 + i] = late.rows
    return count / steps, share_interval(count, steps), p_value
