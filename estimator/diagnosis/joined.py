"""A diagnosis of segments, given for the recordings they were cut from.

Users know their recordings by name, and get everything by it: intervals and courses of all its segments, one after the
other; simulations over its whole time, NaN where no segment is; as constant load torque the mean of its segments',
each counting by its good samples; and the response of the segment with the most of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from estimator.diagnosis.result import (
    Course,
    Diagnosis,
    Discrepancy,
    Estimated,
    FoundEffect,
    Interval,
    Profile,
    Response,
    Trace,
)
from estimator.diagnosis.segments import Cut
from estimator.signals.record import FloatArray

Value = TypeVar("Value")
Over = TypeVar("Over", Course, Profile)
Terms = tuple[tuple[str, float], ...]


def joined(diagnosis: Diagnosis, cut: Cut) -> Diagnosis:
    """Return a diagnosis of segments under the names of the recordings they are of."""
    if not cut.rows:
        return diagnosis
    unnamed = diagnosis.unnamed
    return replace(
        diagnosis,
        statement=_text(diagnosis.statement, cut),
        mismatch=replace(diagnosis.mismatch, time_s=_intervals(diagnosis.mismatch.time_s, cut)),
        effects=tuple(_effect(effect, cut) for effect in diagnosis.effects),
        rejected=tuple(replace(rival, reason=_text(rival.reason, cut)) for rival in diagnosis.rejected),
        untestable=tuple(replace(entry, reason=_text(entry.reason, cut)) for entry in diagnosis.untestable),
        unnamed=None if unnamed is None else replace(unnamed, terms=_terms(unnamed.terms, cut)),
        load_torque=_by_recording(diagnosis.load_torque, cut, lambda parts: _mean(parts, cut)),
        traces=_traces(diagnosis.traces, cut),
        warnings=tuple(_text(warning, cut) for warning in diagnosis.warnings),
        discrepancy=None if diagnosis.discrepancy is None else _discrepancy(diagnosis.discrepancy, cut),
    )


def _by_recording(
    values: Mapping[str, Value], cut: Cut, join: Callable[[Mapping[str, Value]], Value]
) -> dict[str, Value]:
    """Join the values of the segments of each recording, in the order of the recordings."""
    found = {}
    for record in cut.whole:
        parts = {name: value for name, value in values.items() if cut.origin[name] == record.name}
        if parts:
            found[record.name] = join(parts)
    return found


def _text(text: str, cut: Cut) -> str:
    """Name recordings where a text names segments."""
    if not cut.rows:
        return text
    names = sorted(cut.rows, key=len, reverse=True)  # run#12 before run#1
    return re.sub("|".join(map(re.escape, names)), lambda match: cut.origin[match.group()], text)


def _terms(terms: Terms, cut: Cut) -> Terms:
    return tuple((_text(name, cut), value) for name, value in terms)


def _intervals(time_s: Mapping[str, tuple[Interval, ...]], cut: Cut) -> dict[str, tuple[Interval, ...]]:
    def one_after_the_other(parts: Mapping[str, tuple[Interval, ...]]) -> tuple[Interval, ...]:
        return tuple(interval for intervals in parts.values() for interval in intervals)

    return _by_recording(time_s, cut, one_after_the_other)


def _effect(effect: FoundEffect, cut: Cut) -> FoundEffect:
    return replace(
        effect,
        statement=_text(effect.statement, cut),
        time_s=_intervals(effect.time_s, cut),
        profiles=_by_recording(effect.profiles, cut, lambda parts: _with_breaks(list(parts.values()))),
    )


def _mean(parts: Mapping[str, Estimated], cut: Cut) -> Estimated:
    """Return the mean of independent estimates, each counting by its segment's good samples."""
    good = {record.name: int(record.okay.sum()) for record in cut.records}
    weights = np.array([good[name] for name in parts], dtype=np.float64)
    weights /= weights.sum()
    value = float(weights @ [part.value for part in parts.values()])
    half = [0.5 * (part.ci95[1] - part.ci95[0]) for part in parts.values()]
    spread = float(np.linalg.norm(weights * half))
    return Estimated(value, (value - spread, value + spread), next(iter(parts.values())).unit)


def _with_breaks(parts: Sequence[Over]) -> Over:
    """Put courses over time one after the other, with a NaN between that breaks the line."""
    time_s: list[FloatArray] = []
    for before, after in zip(parts, [*parts[1:], None], strict=True):
        time_s.append(before.time_s)
        if after is not None:
            time_s.append(np.array([0.5 * (before.time_s[-1] + after.time_s[0])]))

    def values(arrays: Iterable[FloatArray]) -> FloatArray:
        broken = [piece for array in arrays for piece in (array, np.array([np.nan]))]
        return np.concatenate(broken[:-1])

    return replace(
        parts[0],
        time_s=np.concatenate(time_s),
        value=values(part.value for part in parts),
        low=values(part.low for part in parts),
        high=values(part.high for part in parts),
    )


def _traces(traces: Sequence[Trace], cut: Cut) -> tuple[Trace, ...]:
    by_name = {trace.name: trace for trace in traces}
    return tuple(_by_recording(by_name, cut, lambda parts: _whole(parts, cut)).values())


def _whole(parts: Mapping[str, Trace], cut: Cut) -> Trace:
    """Return the trace of a recording from those of its segments."""
    first = next(iter(parts))
    if first not in cut.rows:
        return parts[first]
    record = next(record for record in cut.whole if record.name == cut.origin[first])
    nominal, retuned, augmented = np.full((3, record.okay.size), np.nan)
    okay = np.zeros_like(record.okay)
    for name, part in parts.items():
        rows = cut.rows[name]
        okay[rows] = part.okay
        nominal[rows], retuned[rows], augmented[rows] = part.nominal, part.retuned, part.augmented
    return replace(
        parts[first],
        name=record.name,
        time_s=record.time_s,
        torque_nm=record.torque_nm,
        measured=record.output,
        okay=okay,
        nominal=nominal,
        retuned=retuned,
        augmented=augmented,
    )


def _discrepancy(seen: Discrepancy, cut: Cut) -> Discrepancy:
    good = {record.name: int(record.okay.sum()) for record in cut.records}

    def longest(parts: Mapping[str, Response]) -> Response:
        return parts[max(parts, key=good.__getitem__)]

    return replace(
        seen,
        laws=tuple(replace(law, terms=_terms(law.terms, cut)) for law in seen.laws),
        equivalents=tuple(
            replace(each, courses=_by_recording(each.courses, cut, lambda parts: _with_breaks(list(parts.values()))))
            for each in seen.equivalents
        ),
        responses=_by_recording(seen.responses, cut, longest),
        pictures=tuple(replace(picture, name=_text(picture.name, cut)) for picture in seen.pictures),
    )
