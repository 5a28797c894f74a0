"""The state of the search for a law at one element, and how many terms of it are worth having."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.line import PLACES, Place
from estimator.diagnosis.unnamed.forms import Form
from estimator.diagnosis.unnamed.ground import Ground
from estimator.diagnosis.unnamed.pursuit import Path
from estimator.diagnosis.unnamed.scene import Scene
from estimator.physics.effect import Element
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray

RIDGE = 1e-5
"""Keeps columns that are combinations of others small; a share of a column's norm."""

MOST_FORCE = 0.8
"""Largest RMS of a law, in RMS of the torque (or reading) in use: a law that takes more than the line carries is no
small thing left out but a way to cancel what is there."""


@dataclass(frozen=True, slots=True)
class Found:
    """A law and what it costs.

    Attributes
    ----------
    terms : tuple of (str, float)
        Its terms with their coefficients or, of several coefficients, the RMS of what they do.
    coefficients : int
    choices : float
        Logarithm of the number of laws it was chosen among.
    """

    terms: tuple[tuple[str, float], ...]
    coefficients: int
    choices: float

    def information(self, before: float, after: float, n: float) -> float:
        """Return what the law gains in BIC, its choice paid for."""
        return n * math.log(before / after) - self.coefficients * math.log(n) - 2.0 * self.choices


NO_LAW = Found((), 0, 0.0)


@dataclass(frozen=True, slots=True)
class Hunt:
    """The state of the search at one element.

    Attributes
    ----------
    view, ground : Scene, Ground
        Where it looks from, and what re-tuning could explain there.
    pool : int
        How many forms were tried.
    forms : list of Form
        Those that further rounds choose from.
    weights : list of ndarray, shape (B,)
        The law that ``view`` is simulated with, per recording: zero in the first round.
    law : Found
        That law; in the first round the one the path promises.
    mean_square : float
        What it leaves of the error.
    errors : list of ndarray
        That error, per recording.
    stuck : bool
        True where no step made the simulation better.
    rounds : int
        How many the search at all elements has behind it.
    """

    element: Element
    view: Scene
    ground: Ground
    pool: int
    forms: list[Form]
    path: Path
    weights: list[FloatArray]
    law: Found
    mean_square: float
    errors: list[FloatArray]
    stuck: bool
    rounds: int = 1


def worthwhile(hunt: Hunt) -> int:
    """Return how many terms of a path are worth their coefficients and take no more force than the line has."""
    path, ground = hunt.path, hunt.ground
    _, left = path.solved(len(path.chosen), RIDGE)
    n = effective_samples(ground.split(left))
    best, terms = 0.0, 0
    for count in range(1, len(path.chosen) + 1):
        gained = cost(hunt, count).information(path.squares[0], path.squares[count], n)
        if gained <= best:
            continue
        coefficients = path.weighed(count, RIDGE)
        if rms(weights_of(hunt, count, coefficients)) <= MOST_FORCE * _in_use(hunt):
            best, terms = gained, count
    return terms


def cost(hunt: Hunt, terms: int, named: tuple[tuple[str, float], ...] = ()) -> Found:
    """Return the law of the first terms of a path, with what it costs."""
    return Found(named, hunt.path.coefficients[terms], terms * math.log(hunt.pool))


def weights_of(hunt: Hunt, terms: int, coefficients: FloatArray) -> list[FloatArray]:
    """Return the first terms of a path as one function of time per recording, shape (B,)."""
    motions = hunt.view.motions(hunt.element)
    built = [hunt.forms[i].build(motions) for i in hunt.path.chosen[:terms]]
    return [np.hstack([form[i] for form in built]) @ coefficients for i in range(len(motions))]


def terms_of(hunt: Hunt, terms: int, coefficients: FloatArray) -> tuple[tuple[str, float], ...]:
    """Return the first terms of a path by name, with their coefficients; see ``Found``."""
    motions = hunt.view.motions(hunt.element)
    term = hunt.path.term[hunt.path.term < terms]
    found = []
    for i, each in enumerate(hunt.path.chosen[:terms]):
        mine = coefficients[term == i]
        form = hunt.forms[each]
        value = float(mine[0]) if mine.size == 1 else float(np.std(np.vstack(form.build(motions)) @ mine))
        found.append((form.law, value))
    return tuple(found)


def _in_use(hunt: Hunt) -> float:
    at_sensor = PLACES[hunt.element] is Place.SENSOR
    return rms([line.reading.speed if at_sensor else line.motion.torque for line in hunt.view.cut])


def rms(parts: Sequence[FloatArray]) -> float:
    """Return the RMS over all recordings."""
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))
