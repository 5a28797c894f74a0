"""What a diagnosis says. The fields are those of ``diagnosis.json`` in the contract, one to one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from estimator.errors import Cure
from estimator.identification.linear_model import ComplexArray
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel
from estimator.signals.record import BoolArray, FloatArray

Interval = tuple[float, float]

_AT: dict[str, Element] = {
    "J_M": Element.MOTOR,
    "b_M": Element.MOTOR,
    "J_L": Element.LOAD,
    "b_L": Element.LOAD,
}
"""Where a nominal parameter is; the others are a shaft's, or of what is between two."""


class Verdict(Enum):
    """The honest answers."""

    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"
    NO_MISMATCH = "no_mismatch"


@dataclass(frozen=True, slots=True)
class Doubt:
    """What the input itself makes doubtful, before anything is fitted; while there is one, nothing is sure.

    ``odds`` are those that something is wrong; ``line`` is what to write in ``[signals]``, from ``cure``, where it is
    known and was tried.
    """

    about: str  # the recordings
    statement: str
    odds: float
    line: str = ""
    cure: Cure | None = None


@dataclass(frozen=True, slots=True)
class Region:
    """Operating region where the mismatch lives: the range of one signal."""

    signal: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Mismatch:
    """Where simulation and recordings differ; ``time_s`` gives intervals per recording name [s]."""

    detected: bool
    element: Element | None
    time_s: Mapping[str, tuple[Interval, ...]]
    band_hz: Interval | None
    region: Region | None
    p_value: float


@dataclass(frozen=True, slots=True)
class Estimated:
    """An estimated value with its 95 % interval and unit."""

    value: float
    ci95: Interval
    unit: str


@dataclass(frozen=True, slots=True)
class Retuned:
    """A nominal parameter, before and after."""

    nominal: float
    value: float
    ci95: Interval
    unit: str


@dataclass(frozen=True, slots=True)
class Evidence:
    """Why an effect is believed: information gained, error on unseen data, probability under the null."""

    delta_bic: float
    holdout_rms_before: float
    holdout_rms_after: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Profile:
    """A quantity found over a recording's own time (road grade): value with its 95 % band at each knot."""

    time_s: FloatArray
    value: FloatArray
    low: FloatArray
    high: FloatArray
    unit: str


@dataclass(frozen=True, slots=True)
class Counted:
    """How many names of such a standing were there, in worlds that took no part in choosing a threshold."""

    right: int
    of: int

    @property
    def probability(self) -> float:
        """What the count shows of the next such name: Laplace's rule of succession, never above the share itself."""
        return min((self.right + 1.0) / (self.of + 2.0), self.right / self.of)


@dataclass(frozen=True, slots=True)
class FoundEffect:
    """An effect that explains the mismatch."""

    name: str
    element: Element
    statement: str
    parameters: Mapping[str, Estimated]
    time_s: Mapping[str, tuple[Interval, ...]]
    indistinguishable_from: tuple[str, ...]
    evidence: Evidence
    profiles: Mapping[str, Profile] = field(default_factory=dict)
    alternatives: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    share: float = math.nan
    probability: float = math.nan
    form: str = ""
    necessity: float = math.nan  # share of the squared error beyond the noise that comes back without it, unseen data
    least_necessity: float = math.nan  # lower end of its one-sided 95 % interval, by which such names were counted
    counted: Counted | None = None


@dataclass(frozen=True, slots=True)
class Remainder:
    """What names leave beyond noise and drift: its share of the re-tuned model's squared error, and what it is like."""

    share: float
    times_noise: float
    element: Element | None  # of the law without a name that it follows, where one is in the augmented model
    band_hz: Interval | None
    law: str  # what it does that noise does not, and the law it follows; the end of a sentence that begins with "it"


@dataclass(frozen=True, slots=True)
class Slight:
    """An effect that the data show but that is no name: it hardly moves the error (a trace in the contract)."""

    name: str
    share: float
    parameters: Mapping[str, float]
    moves: Mapping[str, float] = field(default_factory=dict)  # values that leave their intervals without it: share
    reason: str = "too small to matter"  # why it is no name


@dataclass(frozen=True, slots=True)
class Refinement:
    """An effect of the set that simulates best that is not established, and is not in the augmented model."""

    name: str
    reason: str
    necessity: float  # of a name, as `FoundEffect` has it
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class RejectedEffect:
    """A rival that was fitted, and why it lost; ``delta_bic`` is against the chosen explanation (negative)."""

    name: str
    reason: str
    delta_bic: float


@dataclass(frozen=True, slots=True)
class Effort:
    """What the search cost, in work that is the same on every machine, and what it did not get to."""

    level: str = "normal"  # ``quick``, ``normal`` or ``thorough``
    simulations: int = 0  # free runs of all recordings
    finished: bool = True  # false where a limit of time ended it
    untried: tuple[str, ...] = ()  # effects that were promising, or not looked at, and not fitted
    candidates: int = 0  # effects that these recordings can show
    limit_s: float = math.inf


@dataclass(frozen=True, slots=True)
class UntestableEffect:
    """An effect these recordings can't tell, and the test that could; ``needs`` is what must be given for it."""

    name: str
    reason: str
    suggested_test: str
    needs: str = ""

    @property
    def cure(self) -> str:
        """What to do, in a few words."""
        return f"give {self.needs}" if self.needs else f"drive a {self.suggested_test} test"


@dataclass(frozen=True, slots=True)
class UnnamedTable:
    """A law without a name that is in the augmented model: a torque over one quantity, a curve through knots."""

    place: str  # key of the model file's ``[tables]``
    element: Element
    over: str  # what it is a function of, in words, and its unit
    unit: str
    torque_unit: str
    knots: tuple[float, ...]
    values: tuple[float, ...]  # at the knots, and their 95 % intervals
    ci95: tuple[Interval, ...]
    reached: Interval  # where the recordings were: beyond, the curve is a guess
    rms_before: float  # free-run error on samples that no fit has seen, without it and with it [unit of the output]
    rms_after: float
    looks_like: str  # known law within the band, the end of a sentence; "" where none is
    formula: str  # shortest one within the band; "" without one
    rival: str  # what a curve over which explains nearly as much
    not_carried: tuple[str, ...]  # recordings on which the error does not fall


@dataclass(frozen=True, slots=True)
class OutputFit:
    """RMS of the free-run error of a further measured output, in ``unit``, and the noise of its reading."""

    name: str
    kind: str
    at: str
    unit: str
    retuned: float
    augmented: float
    noise: float


@dataclass(frozen=True, slots=True)
class Fit:
    """RMS of the free-run simulation error, in ``unit``; holdout on samples not used for that fit.

    Of the recordings' first output; ``outputs`` has the further ones.
    """

    unit: str
    nominal: float
    retuned: float
    augmented: float
    holdout_retuned: float
    holdout_augmented: float
    noise_floor: float
    outputs: tuple[OutputFit, ...] = ()


@dataclass(frozen=True, slots=True)
class Trace:
    """One recording with its simulations, for plots; each array has shape (N,), ``torque_nm`` (N, M)."""

    name: str
    time_s: FloatArray
    torque_nm: FloatArray
    measured: FloatArray
    okay: BoolArray
    nominal: FloatArray
    retuned: FloatArray
    augmented: FloatArray
    holdout: bool


@dataclass(frozen=True, slots=True)
class Course:
    """An estimate over the time of one recording with its 95 % band; arrays of shape (B,)."""

    time_s: FloatArray
    value: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, slots=True)
class Equivalent:
    """The input at one place that by itself would explain the re-tuned model's error."""

    place: str
    unit: str
    courses: Mapping[str, Course]  # per recording
    log_likelihood: float  # of the error, if a random walk acts at this place
    plausible: bool


@dataclass(frozen=True, slots=True)
class BandTest:
    """Power of an error in a band: how many times the floor's, and how probable that is by chance, all bands tried."""

    low_hz: float
    high_hz: float
    ratio: float
    p_value: float


@dataclass(frozen=True, slots=True)
class ErrorSpectrum:
    """Amplitude spectral density of the error over all recordings [unit of the output per root hertz]; shapes (M,)."""

    frequency_hz: FloatArray
    before: FloatArray
    after: FloatArray
    floor: float
    bands: tuple[BandTest, ...]


@dataclass(frozen=True, slots=True)
class Response:
    """Response from torque to output in one recording, without a model and of the models; shapes (M,)."""

    frequency_hz: FloatArray
    measured: ComplexArray
    std: FloatArray
    coherence: FloatArray
    before: ComplexArray
    after: ComplexArray
    p_before: float
    p_after: float


@dataclass(frozen=True, slots=True)
class LawPicture:
    """A law over the signal it depends on, with the data: both are averages over bins; arrays of shape (K,)."""

    name: str  # of the effect
    element: Element
    signal: str  # what it is drawn over, and the unit of torque or reading
    signal_unit: str
    unit: str
    x: FloatArray  # mean of the signal in each bin
    data: FloatArray
    low: FloatArray
    high: FloatArray
    law: FloatArray  # the law, seen in the same way
    explained: float  # share of the law's power over time that is a function of this signal


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """What the re-tuned model lacks: as an input at every place, over time, frequency and operating region."""

    element: Element  # where an input alone would make the error most probable
    equivalents: tuple[Equivalent, ...]
    spectrum: ErrorSpectrum
    responses: Mapping[str, Response]
    pictures: tuple[LawPicture, ...]


@dataclass(frozen=True, slots=True)
class OffNominal:
    """A nominal parameter that explains more outside of its tolerance."""

    name: str
    ratio: float  # its value there over the nominal one
    tolerance: float  # share of the nominal value that it is trusted to
    nominal: float | None = None
    unit: str = ""

    @property
    def element(self) -> Element:
        """Where it is in the chain."""
        return _AT.get(self.name, Element.SHAFT)


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The whole answer.

    ``load_torque`` is the constant load torque of each recording, by name; ``discrepancy`` is what the report draws of
    the mismatch; ``off_nominal`` are nominal values that alone, beyond what they are trusted to, would explain it to
    the noise; ``table`` is the law without a name in the augmented model, where one is.
    """

    verdict: Verdict
    statement: str
    mismatch: Mismatch
    effects: tuple[FoundEffect, ...]
    rejected: tuple[RejectedEffect, ...]
    untestable: tuple[UntestableEffect, ...]
    fit: Fit
    parameters: Mapping[str, Retuned]
    load_torque: Mapping[str, Estimated]
    timing_s: Mapping[str, float]
    augmented: DrivelineModel
    traces: tuple[Trace, ...]
    warnings: tuple[str, ...] = ()
    discrepancy: Discrepancy | None = None
    off_nominal: tuple[OffNominal, ...] = ()
    remainder: Remainder | None = None
    slight: tuple[Slight, ...] = ()
    refinements: tuple[Refinement, ...] = ()
    table: UnnamedTable | None = None
    effort: Effort = field(default_factory=Effort)
    doubts: tuple[Doubt, ...] = ()
