"""What each candidate is worth: all of the table undone, in all recordings or in one alone, and weighed.

A candidate is weighed by how well torque and line then explain the motion: with R_i the share that stays unexplained in
recording i, and r_i the inertia that it fits over the nominal one,

    w = prior * product over i of  R_i^-4 * p(r_i) * p(sizes)

Against it stands "something else", which leaves a share R_0 unexplained and says nothing of the inertia: a candidate
that explains less is no explanation, however far it is ahead of the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.preconditions.candidates import (
    Change,
    Line,
    Part,
    Row,
    changes_of,
    of_one_unit,
    rows_for,
)
from estimator.diagnosis.preconditions.inertia import BODY, Inertia, Measured, fitted_inertia, measured, tolerance_of
from estimator.diagnosis.priors import MistakePriors
from estimator.diagnosis.thresholds import Inertias, Mistakes
from estimator.errors import Cure
from estimator.signals.record import FloatArray, OutputKind, Record


@dataclass(frozen=True, slots=True)
class Candidate:
    """What would explain the recordings, in all of them or in one alone, with the logarithm of its weight."""

    change: Change  # beyond a factor
    rows: tuple[tuple[Row, float], ...] = ()  # factors, each with its value
    log_weight: float = 0.0  # prior times likelihood
    is_turned: bool = False  # whether the sign of the output is wrong
    only: int | None = None  # the recording that it is wrong in alone
    is_else: bool = False  # something that is not in the list

    @property
    def is_right(self) -> bool:
        """Whether nothing is wrong: what is there is for a diagnosis to find."""
        is_nothing = self.change.is_physics or not self.change.question
        return is_nothing and not (self.rows or self.is_turned or self.is_else)

    @property
    def is_a_factor(self) -> bool:
        """Whether it is a factor alone, as a payload can be, too; whole per mille are no payload."""
        return bool(self.rows) and not (
            self.change.question or self.is_turned or any(row.whole for row, _ in self.rows)
        )

    @property
    def may_be_physics(self) -> bool:
        """Whether missing physics, or another payload in one recording, may look the same."""
        return self.is_a_factor or self.change.is_open or self.only is not None

    @property
    def may_be_refused(self) -> bool:
        """Whether it is wrong in all recordings, and by a known size.

        A scale of any size may be physics, too, such as gravity: it is doubted, as an inertia next to another mistake.
        """
        open_parts = {Part.TORQUE, Part.OUTPUT} | ({Part.MODEL} if self.change.question else set())
        is_of_any_size = any(row.low < row.high and not row.whole and row.part in open_parts for row, _ in self.rows)
        return self.only is None and not self.change.is_open and not is_of_any_size

    def cure(self, record: Record) -> Cure | None:
        """Return what to correct; None where that is not known, or the model, or one recording alone, is to be.

        Two factors are never corrected at once: many pairs have the product of another one.
        """
        known = self.change.cure or (None if self.change.question else Cure(""))
        of_model = any(row.part is Part.MODEL for row, _ in self.rows)
        if known is None or of_model or self.is_right or self.is_else or self.only is not None or len(self.rows) > 1:
            return None
        torque, output = self.factors()
        turned = -1.0 if self.is_turned else 1.0
        if self.is_turned and record.imposed is not None:
            torque, turned = -torque, 1.0
        return replace(
            known, recording=record.name, torque=known.torque * torque, output=known.output * output * turned
        )

    def factors(self) -> tuple[float, float]:
        """Return the factors on the torque and on the output that would put right what is wrong."""
        of = {part: math.prod(f for row, f in self.rows if row.part is part) for part in (Part.TORQUE, Part.OUTPUT)}
        return of[Part.TORQUE], of[Part.OUTPUT]

    def undone(self, records: Sequence[Record]) -> list[Record]:
        """Return the recordings with it undone."""
        torque, output = self.factors()
        output *= -1.0 if self.is_turned else 1.0
        read = (self.change.undone_in(record) for record in records)
        return [replace(each, torque_nm=each.torque_nm * torque, output=each.output * output) for each in read]

    def question(self, records: Sequence[Record], falls: str) -> str:
        """Say it as a question."""
        if self.is_else:
            return "something else?"
        asked = [self.change.question] if self.change.question else []
        asked += [falls] if self.is_turned else []
        asked += [row.question.format(*map(_rough, (f, 1.0 / f, 100.0 * f, 1e3 * f))) for row, f in self.rows]
        said = ", and ".join(asked) or "does the model lack physics, or a load that was on"
        return said + (f", in {records[self.only].name} alone" if self.only is not None else "") + "?"


Ranked = Sequence[tuple[Candidate, float]]
"""Candidates with their odds, the likeliest first."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """What is doubtful of recordings that do not fit their line."""

    seen: Measured  # the recordings, and what they fit
    best: Candidate  # what most likely explains it
    ranked: Ranked  # all that would
    is_right: float  # odds that nothing is wrong
    is_refused: bool  # whether only a mistake explains it, surely enough to fit nothing
    cure: Cure | None = None  # the line that cures it; none where that is not known, or not clear


def judged(records: Sequence[Record], line: Line, is_tried: bool = False) -> Judgement | None:
    """Return what is doubtful of recordings of one drive; None where nothing is.

    With ``is_tried`` they are asked with a cure applied, and none is looked for.
    """
    seen = measured(records, line)
    if seen is None:
        return None
    ranked = _ranked(seen, line)
    (best, odds), others = ranked[0], [each for each in ranked[1:] if not each[0].is_right]
    is_right = math.fsum(each for candidate, each in ranked if candidate.is_right)
    is_clear = odds >= Mistakes.LIKELY and not (best.is_right or best.is_else)
    if best.is_right or is_right >= Mistakes.DOUBTFUL or (line is None and not is_clear):
        return None
    if best.is_else and not seen.is_off:  # a road, a brake or a driver moved the line
        return None
    cure = None
    if is_clear and not is_tried and odds >= Mistakes.OVER_THE_NEXT * max((each for _, each in others), default=0.0):
        cure = best.cure(seen.records[0])
        if cure is not None and not _passes(best, seen, line):
            cure = None
    is_wrong = 1.0 - is_right - math.fsum(each for candidate, each in ranked if candidate.is_else)
    is_sure = odds >= Mistakes.SURELY if seen.is_right else is_clear
    is_certain = is_wrong >= Mistakes.SURELY and (seen.is_off or (is_sure and not best.may_be_physics))
    return Judgement(seen, best, ranked, is_right, is_certain and best.may_be_refused, cure)


def _passes(best: Candidate, seen: Measured, line: Line) -> bool:
    """Tell whether with a candidate undone the table finds nothing, and no input alone in a unit explains more."""
    undone = best.undone(seen.records)
    if judged(undone, line, is_tried=True) is not None:
        return False
    if line is None or not best.is_a_factor or all(row.low == row.high for row, _ in best.rows):
        return True
    rest = sum(fitted_inertia(record, line).rest for record in undone)
    of_one = of_one_unit(seen.records[0], seen.ratio)
    return all(sum(fitted_inertia(each.undone_in(r), line).rest for r in seen.records) > rest for each in of_one)


def _ranked(seen: Measured, line: Line) -> Ranked:
    """Return all candidates with their odds, the likeliest first."""
    records, found = seen.records, seen.found
    sizes = [largest(record) for record in records]
    is_whole = all(are_whole_numbers(record) for record in records)
    rows, changes = rows_for(line, records[0].kind, is_whole), changes_of(seen, line)
    spread = 0.0 if line is None else MistakePriors.CLOSE[0] * math.log1p(tolerance_of(line))
    off = _log_near(MistakePriors.OFFSETS, max(spread, 0.5 * MistakePriors.CLOSE[1]), MistakePriors.PHYSICS_SHARE)
    off = off - np.logaddexp.reduce(off)
    unknown = [
        math.log(MistakePriors.UNKNOWN_FIT)
        - MistakePriors.REST * math.log(Inertias.TELLS)
        + _usual((), size[0], *size, record)
        for size, record in zip(sizes, records, strict=True)
    ]
    nothing = [
        np.full(MistakePriors.OFFSETS.size, math.log(MistakePriors.STRANGE) + other)
        if each.falls
        else _log_fits(each, size, record, (), np.zeros(1), line)[0]
        for each, size, record, other in zip(found, sizes, records, unknown, strict=True)
    ]
    all_of = [Candidate(Change(), log_weight=math.log(MistakePriors.ELSE) + sum(unknown), is_else=True)]
    for change in changes:
        changed = [change.undone_in(record) for record in records]
        its_line = line if line is None or change.of_line is None else change.of_line(line)
        fits = found if not change.question else [fitted_inertia(each, its_line or BODY) for each in changed]
        if not change.question:  # what moves a line besides its torque is no fault of a recording
            nothing = [a if f.tells else np.maximum(a, b) for a, b, f in zip(nothing, unknown, fits, strict=True)]
        for chosen in _rows_with(change, rows):
            all_of += _candidates(change, chosen, changed, fits, nothing, unknown, off, line)
    most = max(each.log_weight for each in all_of)
    weights = [math.exp(each.log_weight - most) for each in all_of]
    total = math.fsum(weights)
    found_odds = [(each, weight / total) for each, weight in zip(all_of, weights, strict=True)]
    return _once(sorted(found_odds, key=lambda pair: -pair[1]), records)


def _once(ranked: Ranked, records: Sequence[Record]) -> Ranked:
    """Return candidates of the same words as one, with the odds of all of them."""
    kept: dict[str, tuple[Candidate, float]] = {}
    for candidate, odds in ranked:
        words = candidate.question(records, "turned")
        first, so_far = kept.get(words, (candidate, 0.0))
        kept[words] = first, so_far + odds
    return sorted(kept.values(), key=lambda pair: -pair[1])


def _rows_with(change: Change, rows: Sequence[Row]) -> Iterator[tuple[Row, ...]]:
    yield ()
    for k, row in enumerate(rows if change.factors else ()):
        yield (row,)
        for other in rows[k + 1 :] if change.factors > 1 else ():
            is_exact = row.low == row.high or other.low == other.high
            if is_exact and {row.part, other.part} == {Part.TORQUE, Part.OUTPUT}:
                yield row, other


def _candidates(
    change: Change,
    chosen: tuple[Row, ...],
    changed: Sequence[Record],
    fits: Sequence[Inertia],
    nothing: Sequence[FloatArray],
    unknown: Sequence[float],
    off: FloatArray,
    line: Line,
) -> Iterator[Candidate]:
    """Yield a change and factors, in all recordings, and in each of several alone.

    Of the inertias, the nominal one's offset is common to all recordings: they are compared with each other.
    """
    ranged = next((row for row in chosen if row.low != row.high), None)
    logs = np.zeros(1) if ranged is None else np.linspace(math.log(ranged.low), math.log(ranged.high), Mistakes.STEPS)
    prior = math.log(change.prior) + sum(math.log(row.prior) for row in chosen)
    is_nothing = not (chosen or change.question)
    at = [
        np.logaddexp(
            _log_fits(each, largest(record), record, chosen, logs, line), math.log(MistakePriors.STRANGE) + other
        )
        for each, record, other in zip(fits, changed, unknown, strict=True)
    ]
    is_turned = sum(each.falls for each in fits) > 0.5 * sum(each.tells for each in fits)
    as_most = [  # one that goes the other way than the others is strange
        each if not fit.tells or fit.falls == is_turned else np.full_like(each, math.log(MistakePriors.STRANGE) + other)
        for each, fit, other in zip(at, fits, unknown, strict=True)
    ]

    def made(total: FloatArray, log_prior: float, only: int | None) -> Candidate:
        by_factor = np.logaddexp.reduce(total + off, axis=-1)
        best = float(logs[np.argmax(by_factor)])
        factors = tuple((row, row.low if row.low == row.high else float(f"{math.exp(best):.2g}")) for row in chosen)
        weight = float(np.logaddexp.reduce(by_factor) - math.log(logs.size)) + log_prior
        turned = is_turned if only is None else fits[only].falls
        return Candidate(change, factors, weight + (math.log(MistakePriors.TURNED) if turned else 0.0), turned, only)

    all_nothing = np.sum(nothing, axis=0)
    if not (change.is_of_one or any(row.alone for row in chosen)):
        yield made(all_nothing[np.newaxis] if is_nothing and not is_turned else np.sum(as_most, axis=0), prior, None)
    may_be_alone = len(changed) > 1 and len(chosen) < 2 and change.may_be_alone and not change.is_physics
    for i in range(len(changed) if may_be_alone else 0):
        if is_nothing and not fits[i].falls:
            continue
        yield made(at[i] + all_nothing - nothing[i], prior + math.log(MistakePriors.ALONE / len(changed)), i)


def _log_fits(
    found: Inertia,
    size: tuple[float, float],
    record: Record,
    chosen: tuple[Row, ...],
    logs: FloatArray,
    line: Line,
) -> FloatArray:
    """Return the log likelihood of one recording for every factor out of a range and every offset, shape (L, K)."""
    if not math.isfinite(found.ratio) or found.ratio == 0.0:
        return np.full((logs.size, MistakePriors.OFFSETS.size), -math.inf)
    by = {part: np.zeros(logs.size) for part in Part}
    over = np.full(logs.size, -math.log(abs(found.ratio)))
    for row in chosen:
        of_row = math.log(row.low) if row.low == row.high else logs
        by[row.part] = by[row.part] + of_row
        over = over - row.sign * of_row
    is_model = any(row.part is Part.MODEL for row in chosen)
    left = over[:, np.newaxis] - MistakePriors.OFFSETS
    fit = (
        np.full_like(left, math.log(MistakePriors.UNKNOWN_FIT))
        if line is None
        else _log_near(left, MistakePriors.CLOSE[1], MistakePriors.STRANGE)
    )
    bands = 0.0
    if math.isfinite(found.log_ratio):
        other = _normal(found.log_ratio, MistakePriors.BANDS_OTHER)
        near = (1.0 - MistakePriors.BANDS_PHYSICS) * _normal(
            found.log_ratio, MistakePriors.BANDS
        ) + MistakePriors.BANDS_PHYSICS * other
        bands = math.log((other if is_model else near) or 1e-300)
    torque, output = size[0] * np.exp(by[Part.TORQUE]), size[1] * np.exp(by[Part.OUTPUT])
    usual = np.array([_usual(chosen, size[0], float(t), float(o), record) for t, o in zip(torque, output, strict=True)])
    return fit + usual[:, np.newaxis] + bands - MistakePriors.REST * math.log(max(found.rest, MistakePriors.LEAST_REST))


def _log_near(over: FloatArray, spread: float, often: float) -> FloatArray:
    """Return the log density of an inertia's offset: as close as its spread, or, that often, as physics makes it."""
    wide = math.hypot(spread, MistakePriors.PHYSICS)
    near = [math.log(w / s) - 0.5 * (over / s) ** 2 for w, s in ((1.0 - often, spread), (often, wide))]
    result: FloatArray = np.logaddexp(*near) - 0.5 * math.log(2.0 * math.pi)
    return result


def _normal(x: float, spread: float) -> float:
    return math.exp(-0.5 * (x / spread) ** 2) / (spread * math.sqrt(2.0 * math.pi))


def _usual(chosen: Sequence[Row], read: float, torque_nm: float, output: float, record: Record) -> float:
    """Return the log density of the largest torque and speed."""
    reads = next((row.reads for row in chosen if row.reads is not None), None)
    if reads is not None:
        of_torque = -math.log(math.log(reads[1] / reads[0])) if reads[0] <= read <= reads[1] else -math.inf
    else:
        of_torque = _log_size(torque_nm, *MistakePriors.USUAL_TORQUE_NM)
    if record.kind is not OutputKind.SPEED:
        return of_torque
    return (
        of_torque
        + _log_size(output, *MistakePriors.USUAL_SPEED_RAD_S)
        + (math.log(MistakePriors.UNREACHED) if output > MistakePriors.FASTEST_RAD_S else 0.0)
    )


def _log_size(value: float, median: float, spread: float) -> float:
    off = min(abs(math.log(max(value, 1e-12) / median)) / spread, MistakePriors.FAR)
    return -0.5 * off**2 - math.log(spread * math.sqrt(2.0 * math.pi))


def largest(record: Record) -> tuple[float, float]:
    """Return the largest torque and output of a recording, but for the wildest in a thousand."""
    torque, output = np.abs(record.torque_nm).max(axis=1), np.abs(record.output[record.okay])
    return float(np.quantile(torque, 0.999)), float(np.quantile(output, 0.999))


def are_whole_numbers(record: Record) -> bool:
    """Tell whether the torques of a recording are whole numbers, more than a few levels that were asked for."""
    read = record.torque_nm[np.isfinite(record.torque_nm).all(axis=1)]
    return (
        bool(np.abs(read - np.round(read)).max() <= Mistakes.WHOLE) and np.unique(read).size >= Mistakes.FEWEST_VALUES
    )


def _rough(value: float) -> str:
    """Return a number that is as exact as the model is."""
    return f"{float(f'{value:.2g}'):g}"
