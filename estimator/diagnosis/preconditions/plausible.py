"""Do recordings and model fit together? One table of candidates, asked once of all recordings before any fit.

Every candidate is undone, in all recordings or in one alone, and weighed by how well torque and line then explain the
motion: with R_i the share that stays unexplained in recording i, and r_i the inertia that it fits over the nominal one,

    w = prior * product over i of  R_i^-4 * p(r_i) * p(sizes)

Against it stands "something else", which leaves a share R_0 unexplained and says nothing of the inertia: a candidate
that explains less is no explanation, however far it is ahead of the others. A line that cures is handed out only where
the table, asked again with the line applied, finds nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.wording import times as multiple
from estimator.diagnosis.preconditions.candidates import (
    STEPS,
    Change,
    Line,
    Part,
    Row,
    changes_of,
    of_one_unit,
    rows_for,
    times,
)
from estimator.diagnosis.preconditions.inertia import BODY, TELLS, Inertia, fitted_inertia
from estimator.diagnosis.result import Doubt
from estimator.errors import Cure, Implausible
from estimator.physics.model import DrivelineModel, Motion, parameter_unit
from estimator.signals.record import FloatArray, OutputKind, Record

BEYOND = 2.5
"""Factor beyond an inertia's tolerance that is implausible: payloads, derating and closed clutches are less, the
smallest factor between units (3.6) is more."""

BANDS_BEYOND = math.log(8.0)
"""Logarithm of the ratio of the inertias seen below and above the first mode from which on inertias are doubted: a
torque path with a lag of 50 ms, or a filter like it, makes a fifth."""

APART = math.log(1.3)
"""Logarithm of the ratio of the inertias of two recordings from which on they are compared: of one line, bands and
body differ by less."""

LIKELY, OVER_THE_NEXT = 0.5, 4.0
"""Odds of a candidate from which on its line is tried, and how much larger than those of the next."""

SURELY = 0.9
"""Odds that something listed is wrong from which on an inertia that can't be is refused, whichever of it it is."""

DOUBTFUL = 0.5  # odds that nothing is wrong below which recordings are doubted
FEWEST_ODDS, MOST_NAMED = 0.01, 7  # odds from which on a candidate is named, and how many are

MOST_LOAD = 10.0
"""Factor by which a load machine's torque may exceed all torque of the motor: more would turn the motor over."""

# --- how well a candidate fits

CLOSE = 0.6, 0.1
"""Spread of the logarithm of the inertia's ratio: this share of the tolerance, and the error of its fit."""

PHYSICS, PHYSICS_SHARE = math.log(2.0), 0.08
"""Spread where physics is missing or a payload is on, and how often that is."""

BANDS, BANDS_PHYSICS, BANDS_OTHER = 0.35, 0.1, 1.2
"""Spread of the two bands' ratio, the share of the cases in which physics spreads it further, and that."""

REST, LEAST_REST = 4.0, 0.02
"""Power of the unexplained motion: as of eight independent stretches; and what the shortest model error leaves."""

UNKNOWN_FIT = 1.0 / 6.0  # density of an inertia that nothing tells: from a twentieth to twenty times
ELSE, TURNED, ALONE = 0.05, 0.15, 0.2  # priors of something else, of a sign turned, and of one recording alone

USUAL_TORQUE_NM, USUAL_SPEED_RAD_S = (200.0, math.log(8.0)), (80.0, math.log(5.0))
"""Median, and spread of the logarithm, of the largest torque and speed in a recording of a drive."""

WHOLE, FEWEST_VALUES = 1e-6, 5
"""How far whole numbers may be off, and how many there must be: fewer are levels that were asked for."""

STRANGE = 0.02  # share of the recordings in which something else is, too, or physics that is in no other
OFFSETS = np.linspace(-2.0, 2.0, 81)  # of the logarithm of the nominal inertia that are tried


@dataclass(frozen=True, slots=True)
class Candidate:
    """What would explain the recordings, in all of them or in one alone, with the logarithm of its weight."""

    change: Change
    rows: tuple[tuple[Row, float], ...] = ()
    log_weight: float = 0.0
    is_turned: bool = False
    only: int | None = None  # the recording that it is wrong in alone
    is_else: bool = False

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

    def cure(self, record: Record) -> Cure | None:
        """Return what to correct; None where that is not known, or the model, or one recording alone, is to be.

        Two factors are never corrected at once: many pairs have the product of another one.
        """
        known = self.change.cure or (None if self.change.question else Cure(""))
        of_model = any(row.part is Part.MODEL for row, _ in self.rows)
        if known is None or of_model or self.is_right or self.is_else or self.only is not None or len(self.rows) > 1:
            return None
        torque, output = self._factors()
        turned = -1.0 if self.is_turned else 1.0
        if self.is_turned and record.imposed is not None:
            torque, turned = -torque, 1.0
        return replace(
            known, recording=record.name, torque=known.torque * torque, output=known.output * output * turned
        )

    def _factors(self) -> tuple[float, float]:
        of = {part: math.prod(f for row, f in self.rows if row.part is part) for part in (Part.TORQUE, Part.OUTPUT)}
        return of[Part.TORQUE], of[Part.OUTPUT]

    def undone(self, records: Sequence[Record]) -> list[Record]:
        """Return the recordings with it undone."""
        torque, output = self._factors()
        by = times(torque, -output if self.is_turned else output)
        return [by(_changed(record, self.change)) for record in records]

    def question(self, records: Sequence[Record], falls: str) -> str:
        """Say it as a question."""
        if self.is_else:
            return "something else?"
        asked = [self.change.question] if self.change.question else []
        asked += [falls] if self.is_turned else []
        asked += [row.question.format(*map(_rough, (f, 1.0 / f, 100.0 * f, 1e3 * f))) for row, f in self.rows]
        said = ", and ".join(asked) or "does the model lack physics, or a load that was on"
        return said + (f", in {records[self.only].name} alone" if self.only is not None else "") + "?"


def doubts_about(records: Sequence[Record], model: DrivelineModel | None) -> list[Doubt]:
    """Ask the table of recordings of one drive, and of their model where there is one.

    Returns
    -------
    list of Doubt
        What recordings and model leave doubtful, the likeliest first; empty where they fit.

    Raises
    ------
    Implausible
        Where only a wrong unit, sign, column, period or model explains them.
    """
    for record in records:
        _require_plausible_load(record)
    line = None if model is None else replace(model, effects={})
    moving = [each for each in records if np.ptp(each.output[each.okay]) > 0.0]
    doubt, is_refused = _judged([_less_its_load(record) for record in moving], line)
    if doubt is not None and is_refused:
        raise Implausible(doubt.statement, doubt.cure)
    return [] if doubt is None else [doubt]


def _judged(records: Sequence[Record], line: Line, is_tried: bool = False) -> tuple[Doubt | None, bool]:
    """Return what is doubtful, if anything, and whether recordings are refused for it."""
    fits = [(record, fitted_inertia(record, line or BODY)) for record in records]
    # one that is too short for its line says nothing: a period that makes it longer would explain more of nothing
    long = [(record, each) for record, each in fits if line is None or not math.isnan(each.ratio)]
    if not long:
        return None, False
    records, found = [record for record, _ in long], [each for _, each in long]
    if line is not None and not _is_suspicious(found, line):
        return None, False
    ranked = _ranked(records, line, found)
    (best, odds), others = ranked[0], [each for each in ranked[1:] if not each[0].is_right]
    is_right = math.fsum(each for candidate, each in ranked if candidate.is_right)
    is_off = line is not None and any(each.tells and not _is_plausible(each, line) for each in found)
    is_clear = odds >= LIKELY and not (best.is_right or best.is_else)
    may_be_physics = best.is_a_factor or best.change.is_open or best.only is not None
    if best.is_right or is_right >= DOUBTFUL or (line is None and not is_clear):
        return None, False
    if best.is_else and not is_off:  # a road, a brake or a driver moved the line
        return None, False
    cure = None
    if is_clear and not is_tried and odds >= OVER_THE_NEXT * max((each for _, each in others), default=0.0):
        cure = best.cure(records[0])
        if cure is not None and not _passes(best, records, line, found):
            cure = None
    is_wrong = 1.0 - is_right - math.fsum(each for candidate, each in ranked if candidate.is_else)
    is_one_of_all = best.only is None and not best.change.is_open
    # a gear ratio or a scale of any size may be physics as well, such as gravity: it is doubted
    is_of_any_size = any(row.low < row.high and not row.whole and row.part is not Part.MODEL for row, _ in best.rows)
    may_be_refused = is_one_of_all and not is_of_any_size
    is_refused = may_be_refused and (is_wrong >= SURELY if is_off else is_clear and not may_be_physics)
    if line is None and best.is_a_factor and not is_clear:
        return None, False
    about = ", ".join(record.name for record in _blamed(records, found, line, best))
    return Doubt(about, _text(records, line, found, ranked), 1.0 - is_right, cure=cure), is_refused


def _ratio(found: Sequence[Inertia], line: Line) -> float:
    """Return the ratio of the inertias that are beyond their tolerance; 1 where there are none."""
    off = [each.ratio for each in found if each.tells and line is not None and not _is_within_tolerance(each, line)]
    return float(np.median(off)) if off else 1.0


def _passes(best: Candidate, records: Sequence[Record], line: Line, found: Sequence[Inertia]) -> bool:
    """Tell whether with a candidate undone the table finds nothing, and no input alone in a unit explains more."""
    undone = best.undone(records)
    if _judged(undone, line, is_tried=True)[0] is not None:
        return False
    if line is None or not best.is_a_factor or all(row.low == row.high for row, _ in best.rows):
        return True
    rest = sum(fitted_inertia(record, line).rest for record in undone)
    of_one = (
        each for i in range(records[0].torque_nm.shape[1]) for each in of_one_unit(records[0], i, _ratio(found, line))
    )
    return all(sum(fitted_inertia(_changed(record, each), line).rest for record in records) > rest for each in of_one)


def _is_suspicious(found: Sequence[Inertia], line: DrivelineModel) -> bool:
    counted = [math.log(abs(each.ratio)) for each in found if each.tells]
    return (
        any(not each.tells or not _is_within_tolerance(each, line) for each in found)
        or any(abs(each.log_ratio) > BANDS_BEYOND for each in found)
        or (bool(counted) and max(counted) - min(counted) > APART)
    )


def _blamed(records: Sequence[Record], found: Sequence[Inertia], line: Line, best: Candidate) -> list[Record]:
    """Return the recordings that a doubt is about: that one, or those that do not fit; all where none is alone."""
    if best.only is not None:
        return [records[best.only]]
    off = [r for r, each in zip(records, found, strict=True) if line is None or not _is_within_tolerance(each, line)]
    return off or list(records)


def _ranked(records: Sequence[Record], line: Line, found: Sequence[Inertia]) -> list[tuple[Candidate, float]]:
    """Return all candidates with their odds, the likeliest first."""
    sizes = [largest(record) for record in records]
    is_whole = all(are_whole_numbers(record) for record in records)
    rows = rows_for(line, records[0].kind, is_whole)
    spread = 0.0 if line is None else CLOSE[0] * math.log1p(_tolerance(line))
    off = _log_near(OFFSETS, max(spread, 0.5 * CLOSE[1]), PHYSICS_SHARE)
    off = off - np.logaddexp.reduce(off)
    unknown = [
        math.log(UNKNOWN_FIT) - REST * math.log(TELLS) + _usual((), size[0], *size, record)
        for size, record in zip(sizes, records, strict=True)
    ]
    nothing = [
        np.full(OFFSETS.size, math.log(STRANGE) + other)
        if each.falls
        else _log_fits(each, size, record, (), np.zeros(1), line)[0]
        for each, size, record, other in zip(found, sizes, records, unknown, strict=True)
    ]
    all_of = [Candidate(Change(), log_weight=math.log(ELSE) + sum(unknown), is_else=True)]
    for change in changes_of(records, line, _ratio(found, line)):
        changed = [_changed(record, change) for record in records]
        its_line = line if line is None or change.of_line is None else change.of_line(line)
        fits = found if not change.question else [fitted_inertia(each, its_line or BODY) for each in changed]
        if not change.question:  # what moves a line besides its torque is no fault of a recording
            nothing = [a if f.tells else np.maximum(a, b) for a, b, f in zip(nothing, unknown, fits, strict=True)]
        for chosen in _rows_with(change, rows):
            all_of += _candidates(change, chosen, changed, fits, nothing, unknown, off, line)
    most = max(each.log_weight for each in all_of)
    weights = [math.exp(each.log_weight - most) for each in all_of]
    total = math.fsum(weights)
    ranked = [(each, weight / total) for each, weight in zip(all_of, weights, strict=True)]
    return _once(sorted(ranked, key=lambda pair: -pair[1]), records)


def _once(ranked: Sequence[tuple[Candidate, float]], records: Sequence[Record]) -> list[tuple[Candidate, float]]:
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
    logs = np.zeros(1) if ranged is None else np.linspace(math.log(ranged.low), math.log(ranged.high), STEPS)
    prior = math.log(change.prior) + sum(math.log(row.prior) for row in chosen)
    is_nothing = not (chosen or change.question)
    at = [
        np.logaddexp(_log_fits(each, largest(record), record, chosen, logs, line), math.log(STRANGE) + other)
        for each, record, other in zip(fits, changed, unknown, strict=True)
    ]
    is_turned = sum(each.falls for each in fits) > 0.5 * sum(each.tells for each in fits)
    as_most = [  # one that goes the other way than the others is strange
        each if not fit.tells or fit.falls == is_turned else np.full_like(each, math.log(STRANGE) + other)
        for each, fit, other in zip(at, fits, unknown, strict=True)
    ]

    def made(total: FloatArray, log_prior: float, only: int | None) -> Candidate:
        by_factor = np.logaddexp.reduce(total + off, axis=-1)
        best = float(logs[np.argmax(by_factor)])
        factors = tuple((row, row.low if row.low == row.high else float(f"{math.exp(best):.2g}")) for row in chosen)
        weight = float(np.logaddexp.reduce(by_factor) - math.log(logs.size)) + log_prior
        turned = is_turned if only is None else fits[only].falls
        return Candidate(change, factors, weight + (math.log(TURNED) if turned else 0.0), turned, only)

    all_nothing = np.sum(nothing, axis=0)
    if not (change.is_of_one or any(row.alone for row in chosen)):
        yield made(all_nothing[np.newaxis] if is_nothing and not is_turned else np.sum(as_most, axis=0), prior, None)
    may_be_alone = len(changed) > 1 and len(chosen) < 2 and change.may_be_alone and not change.is_physics
    for i in range(len(changed) if may_be_alone else 0):
        if is_nothing and not fits[i].falls:
            continue
        yield made(at[i] + all_nothing - nothing[i], prior + math.log(ALONE / len(changed)), i)


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
        return np.full((logs.size, OFFSETS.size), -math.inf)
    by = {part: np.zeros(logs.size) for part in Part}
    over = np.full(logs.size, -math.log(abs(found.ratio)))
    for row in chosen:
        of_row = math.log(row.low) if row.low == row.high else logs
        by[row.part] = by[row.part] + of_row
        over = over - row.sign * of_row
    is_model = any(row.part is Part.MODEL for row in chosen)
    left = over[:, np.newaxis] - OFFSETS
    fit = np.full_like(left, math.log(UNKNOWN_FIT)) if line is None else _log_near(left, CLOSE[1], STRANGE)
    bands = 0.0
    if math.isfinite(found.log_ratio):
        other = _normal(found.log_ratio, BANDS_OTHER)
        near = (1.0 - BANDS_PHYSICS) * _normal(found.log_ratio, BANDS) + BANDS_PHYSICS * other
        bands = math.log((other if is_model else near) or 1e-300)
    torque, output = size[0] * np.exp(by[Part.TORQUE]), size[1] * np.exp(by[Part.OUTPUT])
    usual = np.array([_usual(chosen, size[0], float(t), float(o), record) for t, o in zip(torque, output, strict=True)])
    return fit + usual[:, np.newaxis] + bands - REST * math.log(max(found.rest, LEAST_REST))


def _log_near(over: FloatArray, spread: float, often: float) -> FloatArray:
    """Return the log density of an inertia's offset: as close as its spread, or, that often, as physics makes it."""
    wide = math.hypot(spread, PHYSICS)
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
        of_torque = _log_size(torque_nm, *USUAL_TORQUE_NM)
    return of_torque + (_log_size(output, *USUAL_SPEED_RAD_S) if record.kind is OutputKind.SPEED else 0.0)


def _log_size(value: float, median: float, spread: float) -> float:
    return -0.5 * (math.log(max(value, 1e-12) / median) / spread) ** 2 - math.log(spread * math.sqrt(2.0 * math.pi))


def largest(record: Record) -> tuple[float, float]:
    """Return the largest torque and output of a recording, but for the wildest in a thousand."""
    torque, output = np.abs(record.torque_nm).max(axis=1), np.abs(record.output[record.okay])
    return float(np.quantile(torque, 0.999)), float(np.quantile(output, 0.999))


def are_whole_numbers(record: Record) -> bool:
    """Tell whether the torques of a recording are whole numbers, more than a few levels that were asked for."""
    read = record.torque_nm[np.isfinite(record.torque_nm).all(axis=1)]
    return bool(np.abs(read - np.round(read)).max() <= WHOLE) and np.unique(read).size >= FEWEST_VALUES


def _changed(record: Record, change: Change) -> Record:
    return record if change.of_record is None else change.of_record(record)


# --- what is said


def _text(
    records: Sequence[Record], line: Line, found: Sequence[Inertia], ranked: Sequence[tuple[Candidate, float]]
) -> str:
    best = ranked[0][0]
    blamed = _blamed(records, found, line, best)
    shown = [each for record, each in zip(records, found, strict=True) if record in blamed]
    is_turn = line is None or line.motion is Motion.ROTATION
    torque = "torque" if is_turn else "force"
    falls = f"is the sign of {torque} or {'motion' if records[0].imposed is not None else 'output'} turned round"
    named = [
        f"{each.question(records, falls)} ({odds:.0%}{_follows(each, records, is_turn)})"
        for each, odds in ranked[:MOST_NAMED]
        if odds >= FEWEST_ODDS or each.is_else
    ]
    if not any(each.is_else for each, _ in ranked[:MOST_NAMED]):
        named.append("something else? (under 1%)")
    names = ", ".join(record.name for record in blamed)
    one = len(blamed) == 1
    return (
        f"recording{'' if one else 's'} {names} {'is' if one else 'are'} implausible: {_misfit(records, line, shown)}. "
        f"What would explain it, with its odds: {'; '.join(named)}. What the drive can do decides, and whose the model "
        "file is; scales and columns stand in [signals]."
    )


def _misfit(records: Sequence[Record], line: Line, shown: Sequence[Inertia]) -> str:
    """Say what does not fit."""
    counted = [each for each in shown if each.tells]
    if line is None or not counted:
        return "the motion does not follow from the torque as read"
    torque = "torque" if line.motion is Motion.ROTATION else "force"
    ratios = ", ".join(multiple(each.ratio) for each in counted)
    if records[0].imposed is not None:
        return f"its {torque} is {ratios} times what the nominal k and c make of the motion, expected 1"
    falls = f"the {records[0].kind.value} falls where the {torque} rises, and " if counted[0].ratio < 0.0 else ""
    bands = [math.exp(each.log_ratio) for each in counted if abs(each.log_ratio) > BANDS_BEYOND]
    above = f"; above the first mode it fits {multiple(1.0 / bands[0])} times that" if bands else ""
    fits = "it fits an inertia" if len(counted) == 1 else "they fit inertias"
    expected = f"expected 1 within its tolerance and a factor of {BEYOND:g}"
    return f"{falls}{fits} {ratios} times the nominal {_nominal(line)}, {expected}{above}"


def _follows(candidate: Candidate, records: Sequence[Record], is_turn: bool) -> str:
    """Say which torques and speeds follow from a factor."""
    if not candidate.rows:
        return ""
    torque, unit = ("torque", "Nm") if is_turn else ("force", "N")
    read = np.max([largest(record) for record in records], axis=0)
    by_torque, by_output = candidate._factors()  # noqa: SLF001
    follows = f", {torque}s up to {by_torque * read[0]:.3g} {unit} then" if by_torque != 1.0 else ""
    return follows + (f", a {records[0].kind.value} up to {by_output * read[1]:.3g} then" if by_output != 1.0 else "")


def _rough(value: float) -> str:
    """Return a number that is as exact as the model is."""
    return f"{float(f'{value:.2g}'):g}"


def _less_its_load(record: Record) -> Record:
    """Return a recording with a measured load torque taken off the first input: as a whole a line moves under both."""
    if record.load_nm is None:
        return record
    torque = record.torque_nm.copy()
    torque[:, 0] -= record.load_nm
    return replace(record, torque_nm=torque, load_nm=None)


def _require_plausible_load(record: Record) -> None:
    if record.load_nm is None:
        return
    load, torque = (float(np.abs(each).max()) for each in (record.load_nm, record.total_torque_nm))
    if load > MOST_LOAD * torque:
        raise Implausible(
            f"recording {record.name} is implausible: its measured load torque reaches {load:.3g} Nm, its torque "
            f"{torque:.3g} Nm. Is load in another unit, or not reflected to the motor shaft? Divide its scale in "
            "[signals] by the gear's ratio."
        )


def _tolerance(line: DrivelineModel) -> float:
    inertias = [each.tolerance for name, each in line.parameters.items() if name.startswith("J")]
    return max(inertias or [each.tolerance for each in line.parameters.values()])


def _is_within_tolerance(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning; one that nothing tells is not."""
    return found.tells and 1.0 - _tolerance(line) <= found.ratio <= 1.0 + _tolerance(line)


def _is_plausible(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning, or of physics missing."""
    tolerance = _tolerance(line)
    return (1.0 - tolerance) / BEYOND <= found.ratio <= (1.0 + tolerance) * BEYOND


def _nominal(line: DrivelineModel) -> str:
    names = [name for name in line.parameters if name.startswith("J")]
    total = sum(line.parameters[name].value for name in names)
    return f"{' + '.join(names)} = {total:g} {parameter_unit(names[0], line.motion)}"
