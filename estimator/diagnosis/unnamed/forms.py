"""The forms of laws without a name: fixed, free, shares of the inputs, waves, changes and steps.

Order analysis tells which waves over the motor's angle a signal holds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.signal import find_peaks

from estimator.diagnosis.line import PLACES, Motion
from estimator.diagnosis.unnamed.laws import CHANGING, FREE, LAWS, MODULATIONS, Law, hats, knots_of, one, top_of
from estimator.diagnosis.unnamed.scene import Scene
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.signals.record import FloatArray

HIGHEST_ORDER = 24.0
"""Periods per motor turn: faster ones pass unseen through any driveline."""

SLOWEST_WAVE = 3.0
"""Waves that fit into a recording at least."""

MOST_PEAKS = 3
"""Orders that are tried of the signal itself, and of its change, the strongest first."""

APART = 10.0
"""Orders that differ by less than this many waves in a recording are one: a wave that comes and goes is no line."""

BINS_PER_WAVE = 4.0

LONGEST_TRAVEL = 30_000.0
"""Angle of one spectrum [rad], some 5000 turns: its grid has a million places."""

FEWEST_SAMPLES = 1024
"""Samples in such a piece; with fewer its waves are not seen."""


def peaks(signals: Sequence[FloatArray], angles: Sequence[FloatArray]) -> FloatArray:
    """Return the orders at which signals of recordings have most power over the angle, strongest first."""
    width = 2.0 * np.pi / (BINS_PER_WAVE * HIGHEST_ORDER)
    signals, angles = _pieces(signals, angles)
    if not angles:
        return np.zeros(0)
    travel = max(float(np.ptp(angle)) for angle in angles)
    if travel < 2.0 * np.pi * SLOWEST_WAVE / HIGHEST_ORDER:
        return np.zeros(0)
    size = 1 << int(np.ceil(np.log2(2.0 * travel / width)))
    orders = 2.0 * np.pi * np.arange(size // 2 + 1) / (size * width)
    good = (orders >= 2.0 * np.pi * SLOWEST_WAVE / travel) & (orders <= HIGHEST_ORDER)
    chosen: list[int] = []
    for prepare in (_centred, _differences):
        power = np.zeros(orders.size)
        for signal, angle in zip(signals, angles, strict=True):
            prepared = prepare(signal)
            place = ((angle - angle.min()) / width).astype(int)
            over_angle = np.bincount(place, prepared, size)
            power += np.abs(np.fft.rfft(over_angle)) ** 2 / max(float(prepared @ prepared), np.finfo(float).tiny)
        found, _ = find_peaks(np.where(good, power, 0.0))
        near = APART * 2.0 * np.pi / travel
        fresh: list[int] = []
        for i in found[np.argsort(-power[found])].tolist():
            if len(fresh) < MOST_PEAKS and all(abs(orders[i] - orders[j]) > near for j in [*chosen, *fresh]):
                fresh.append(i)
        chosen += fresh
    return np.asarray(orders[chosen])


def _pieces(
    signals: Sequence[FloatArray], angles: Sequence[FloatArray]
) -> tuple[Sequence[FloatArray], Sequence[FloatArray]]:
    """Cut recordings that travel further than `LONGEST_TRAVEL`, whose grid over the angle would have no bound.

    Pieces with too few samples for the waves in them are left out: all of them where the angle's unit is wrong.
    """
    if max(float(np.ptp(angle)) for angle in angles) <= LONGEST_TRAVEL:
        return signals, angles
    cut: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for signal, angle in zip(signals, angles, strict=True):
        place = np.floor((angle - angle.min()) / LONGEST_TRAVEL)
        for each in np.unique(place):
            inside = place == each
            if np.count_nonzero(inside) >= FEWEST_SAMPLES:
                cut[0].append(signal[inside])
                cut[1].append(angle[inside])
    return cut


def _centred(signal: FloatArray) -> FloatArray:
    centred: FloatArray = signal - signal.mean()
    return centred


def _differences(signal: FloatArray) -> FloatArray:
    """Return a signal's change from sample to sample: a slow drift is no longer the largest part."""
    return np.diff(signal, prepend=signal[0])


STEP_EVERY_S = 0.5
"""Grid of the moments at which a load torque may step."""

CHANGE_EVERY_S = 1.0
"""Grid of the moments at which an inertia, a stiffness or a drag may change."""

MOST_MOMENTS = 180
"""Moments in all recordings together; longer ones have a coarser grid."""

USUAL_ORDERS = (1.0, 2.0)
"""Waves per motor turn that are tried in any case: imbalance, and joints at an angle."""

COURSE_KNOTS = 11
"""Of a slow course of the load over one recording."""

Columns = FloatArray
"""One or several functions of time of one recording, shape (B, q)."""

Build = Callable[[Sequence[Motion]], list[Columns]]


@dataclass(frozen=True, slots=True)
class Form:
    """The form of a law without a name: from the motion of each recording to its q functions of time."""

    law: str
    build: Build


def forms(view: Scene, element: Element) -> list[Form]:
    """Return every law without a name that is tried at one element."""
    motions = view.motions(element)
    return [
        *_fixed(element),
        *_free(element, motions),
        *_shares(element, motions),
        *_periodic(view, element, motions),
        *_changes(view.result, element, motions),
        *_steps(view.result, element, motions),
    ]


def _single(law: Law) -> Build:
    return lambda motions: [law(m)[:, np.newaxis] for m in motions]


def _fixed(element: Element) -> list[Form]:
    return [Form(name, _single(law)) for name, law in LAWS[element].items()]


def _free(element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return any function of a signal: piecewise linear between knots."""
    found = []
    for name, signal in FREE[element].items():
        knots = knots_of(np.concatenate([signal(m) for m in motions]))
        if knots.size > 2:
            found.append(Form(f"a function of {name}", _function_of(signal, knots)))
    return found


def _function_of(signal: Law, knots: FloatArray) -> Build:
    return lambda motions: [hats(signal(m), knots) for m in motions]


def _shares(element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return that one input counts more than its reading, or is limited by itself; with one input there is no other."""
    inputs = min(m.inputs.shape[1] for m in motions)
    if element is not Element.TORQUE_PATH or inputs == 1:
        return []
    found = [Form(f"T_{j + 1}", _single(partial(_input, j))) for j in range(inputs - 1)]
    for j in range(inputs):
        top = top_of(np.concatenate([_input(j, m) for m in motions]))
        found += [
            Form(f"a part of T_{j + 1} beyond {share:g} of its range", _single(partial(_input_beyond, j, share * top)))
            for share in (0.5, 0.65, 0.8, 0.9)
        ]
    return found


def _input(index: int, motion: Motion) -> FloatArray:
    return motion.inputs[:, index]


def _input_beyond(index: int, limit: float, motion: Motion) -> FloatArray:
    torque = _input(index, motion)
    beyond: FloatArray = torque - np.clip(torque, -limit, limit)
    return beyond


def _periodic(view: Scene, element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return waves over the motor's angle that the input at the element's place shows, each recording its phase."""
    found = []
    for of, modulation in MODULATIONS[element].items():
        inputs = view.explanations[PLACES[element]].inputs
        weighted = [each.value * modulation(m) for each, m in zip(inputs, motions, strict=True)]
        found += [
            Form(f"a wave{of} {order:.3g} times per motor turn", partial(_waves, order, modulation))
            for order in dict.fromkeys([*USUAL_ORDERS, *peaks(weighted, [m.angle for m in motions])])
        ]
    return found


def _waves(order: float, modulation: Law, motions: Sequence[Motion]) -> list[Columns]:
    """Return cosine and sine of each recording, with coefficients of its own."""
    columns = []
    for i, motion in enumerate(motions):
        wide = np.zeros((motion.angle.size, 2 * len(motions)))
        size = modulation(motion)
        wide[:, 2 * i] = size * np.cos(order * motion.angle)
        wide[:, 2 * i + 1] = size * np.sin(order * motion.angle)
        columns.append(wide)
    return columns


def _changes(result: FitResult, element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return laws that set in at every moment of a grid, each in one recording alone."""
    names = _names(result)
    return [
        Form(f"{name} from {moment:.1f} s on in {names[i]}", partial(_from_moment, i, law, moment))
        for i, motion in enumerate(motions)
        for name, law in CHANGING[element].items()
        for moment in moments(motion, CHANGE_EVERY_S, len(motions))
    ]


def _steps(result: FitResult, element: Element, motions: Sequence[Motion]) -> list[Form]:
    one_mass = result.problem.grid.structure is Structure.ONE_MASS
    if element is not (Element.MOTOR if one_mass else Element.LOAD):
        return []
    names = _names(result)
    return [
        Form(f"a load step at {moment:.1f} s in {names[i]}", partial(_from_moment, i, one, moment))
        for i, motion in enumerate(motions)
        for moment in moments(motion, STEP_EVERY_S, len(motions))
    ] + [Form(f"a slow course of the load in {name}", partial(_course, i)) for i, name in enumerate(names)]


def _names(result: FitResult) -> list[str]:
    return [record.name for record in result.problem.records]


def _from_moment(index: int, law: Law, moment: float, motions: Sequence[Motion]) -> list[Columns]:
    columns = [np.zeros((m.time_s.size, 1)) for m in motions]
    motion = motions[index]
    columns[index][:, 0] = np.where(motion.time_s >= moment, law(motion), 0.0)
    return columns


def _course(index: int, motions: Sequence[Motion]) -> list[Columns]:
    """Return a piecewise linear function of the time of one recording."""
    time_s = motions[index].time_s
    knots = np.linspace(time_s[0], time_s[-1], COURSE_KNOTS)
    columns = [np.zeros((m.time_s.size, COURSE_KNOTS)) for m in motions]
    columns[index] = hats(time_s, knots)
    return columns


def moments(motion: Motion, every_s: float, recordings: int) -> FloatArray:
    """Return the moments of one of so many recordings at which something may set in [s]."""
    length_s = float(motion.time_s[-1] - motion.time_s[0])
    every_s = max(every_s, recordings * length_s / MOST_MOMENTS)
    found: FloatArray = motion.time_s[0] + every_s * np.arange(1, max(int(length_s / every_s), 2))
    return found
