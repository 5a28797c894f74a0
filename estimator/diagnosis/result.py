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

SURE = 0.95  # share of names that were right from which on one is sure, as an interval is


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
    statement: str  # what is doubtful, and what would explain it; sentences
    odds: float  # that something is wrong, 0 and up
    line: str = ""  # for `[signals]`; "" where none is known
    cure: Cure | None = None  # what the line does
    differs: Mapping[str, float] = field(default_factory=dict)  # ratios of one recording's line to the others'


@dataclass(frozen=True, slots=True)
class Region:
    """Operating region where the mismatch lives: the range of one signal."""

    signal: str  # torque, motor speed, shaft torque, load speed
    low: float  # of the central 80 % of the error's power
    high: float  # its upper end
    unit: str = ""  # of the signal, SI


@dataclass(frozen=True, slots=True)
class Mismatch:
    """Where simulation and recordings differ; ``time_s`` gives intervals per recording name [s]."""

    detected: bool  # False only of the verdict `NO_MISMATCH`
    element: Element | None  # of the strongest effect, or of the law without a name; None without either
    time_s: Mapping[str, tuple[Interval, ...]]  # where the error over 0.5 s is above the noise
    band_hz: Interval | None  # central 80 % of the error's power above the noise
    region: Region | None  # in the element's own signal
    p_value: float  # of the likelihood ratio between the nominal model and the best set


@dataclass(frozen=True, slots=True)
class Estimated:
    """An estimated value with its 95 % interval and unit."""

    value: float  # in `unit`
    ci95: Interval  # ends of the interval, in `unit`
    unit: str  # SI


@dataclass(frozen=True, slots=True)
class Retuned:
    """A nominal parameter, before and after."""

    nominal: float  # as in the model file, in `unit`
    value: float  # inside its tolerance
    ci95: Interval  # ends of the interval, cut at the tolerance
    unit: str  # SI


@dataclass(frozen=True, slots=True)
class Evidence:
    """Why an effect is believed: information gained, error on unseen data, probability under the null."""

    delta_bic: float  # by how much the score rises without the effect
    holdout_rms_before: float  # free-run error without any effect [unit of the output]
    holdout_rms_after: float  # with all of them
    p_value: float  # of the likelihood ratio without the effect


@dataclass(frozen=True, slots=True)
class Profile:
    """A quantity found over a recording's own time (road grade): value with its 95 % band at each knot."""

    time_s: FloatArray  # (K,), knots
    value: FloatArray  # (K,), in `unit`
    low: FloatArray  # (K,), ends of the band
    high: FloatArray  # (K,)
    unit: str  # SI


@dataclass(frozen=True, slots=True)
class Counted:
    """How many names of such a standing were there, in worlds that took no part in choosing a threshold."""

    right: int  # names that were there
    of: int  # names of such a necessity in all

    @property
    def probability(self) -> float:
        """What the count shows of the next such name: Laplace's rule of succession, never above the share itself."""
        return min((self.right + 1.0) / (self.of + 2.0), self.right / self.of)

    @property
    def is_sure(self) -> bool:
        """Whether such a name is said without a "probably": as often right as the intervals next to it."""
        return self.right >= SURE * self.of

    @property
    def words(self) -> str:
        """The count as a reader needs it, for example ``18 of 22 such names were right: 82 %``."""
        return f"{self.right} of {self.of} such names were right: {100.0 * self.right / self.of:.0f} %"


@dataclass(frozen=True, slots=True)
class FoundEffect:
    """An effect that explains the mismatch."""

    name: str  # key of the catalogue
    element: Element  # where it acts
    statement: str  # one sentence with its sizes
    parameters: Mapping[str, Estimated]  # by name
    time_s: Mapping[str, tuple[Interval, ...]]  # of an event: from when to when, by recording
    indistinguishable_from: tuple[str, ...]  # effects that explain as much in its place
    evidence: Evidence  # why it is believed
    profiles: Mapping[str, Profile] = field(default_factory=dict)  # of `road_grade`, by recording
    alternatives: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # values of those, by effect
    share: float = math.nan  # of the squared free-run error, unseen data, that comes back without it
    probability: float = math.nan  # that it is there, by the count
    form: str = ""  # of its law where it is not the plain one
    necessity: float = math.nan  # share of the squared error beyond the noise that comes back without it, unseen data
    least_necessity: float = math.nan  # lower end of its one-sided 95 % interval, by which such names were counted
    counted: Counted | None = None  # None for faults of the acquisition


@dataclass(frozen=True, slots=True)
class Remainder:
    """What names leave beyond noise and drift: its share of the re-tuned model's squared error, and what it is like."""

    share: float  # of the re-tuned model's squared error
    times_noise: float  # RMS over that of the reading's noise
    element: Element | None  # of the law without a name that it follows, where one is in the augmented model
    band_hz: Interval | None  # central 80 % of its power; None where there is too little
    law: str  # what it does that noise does not, and the law it follows; the end of a sentence that begins with "it"


@dataclass(frozen=True, slots=True)
class Slight:
    """An effect that the data show but that is no name: it hardly moves the error (a trace in the contract)."""

    name: str  # key of the catalogue
    share: float  # of the squared free-run error that comes back without it
    parameters: Mapping[str, float]  # values, SI
    moves: Mapping[str, float] = field(default_factory=dict)  # values that leave their intervals without it: share
    reason: str = "too small to matter"  # why it is no name


@dataclass(frozen=True, slots=True)
class Refinement:
    """An effect of the set that simulates best that is not established, and is not in the augmented model."""

    name: str  # key of the catalogue
    reason: str  # why it is not established
    necessity: float  # of a name, as `FoundEffect` has it
    parameters: Mapping[str, float]  # values, SI


@dataclass(frozen=True, slots=True)
class RejectedEffect:
    """A rival that was fitted, and why it lost; ``delta_bic`` is against the chosen explanation (negative)."""

    name: str  # key of the catalogue
    reason: str  # what was done, and how it compared
    delta_bic: float


@dataclass(frozen=True, slots=True)
class FittedSet:
    """One set of effects of the search: where it was started, how it came out, and why it was left."""

    effects: tuple[str, ...]  # keys of the catalogue; () is the nominal model, re-tuned
    started_from: tuple[str, ...]  # the set whose values were its initial values
    score: float  # minus twice its log posterior, up to a constant: 0 for the most probable set
    rms: float  # free-run error on samples that no fit has seen; NaN where it was not tried [unit of the output]
    outcome: str  # in a few words


@dataclass(frozen=True, slots=True)
class Effort:
    """What the search cost, in work that is the same on every machine, and what it did not get to."""

    level: str = "normal"  # ``quick``, ``normal`` or ``thorough``
    simulations: int = 0  # free runs of all recordings
    finished: bool = True  # false where a limit of time ended it
    untried: tuple[str, ...] = ()  # effects that were promising, or not looked at, and not fitted
    candidates: int = 0  # effects that these recordings can show
    limit_s: float = math.inf  # of time, inf without one [s]
    sets: tuple[FittedSet, ...] = ()  # the smaller first, then the more probable

    @property
    def fitted(self) -> str:
        """Which effects a search without a find speaks of: the end of "no effect"."""
        return "that was fitted" if self.untried else "of the catalogue"


@dataclass(frozen=True, slots=True)
class UntestableEffect:
    """An effect these recordings can't tell, and the test that could; ``needs`` is what must be given for it."""

    name: str  # key of the catalogue
    reason: str  # what the recordings lack
    suggested_test: str  # kind of experiment that would show it
    needs: str = ""

    @property
    def cure(self) -> str:
        """What to do, in a few words."""
        return f"give {self.needs}" if self.needs else f"drive a {self.suggested_test} test"


@dataclass(frozen=True, slots=True)
class UnnamedTable:
    """A law without a name that is in the augmented model: a torque over one quantity, a curve through knots."""

    place: str  # key of the model file's ``[tables]``
    element: Element  # where the torque acts
    over: str  # what it is a function of, in words, and its unit
    unit: str  # of the knots
    torque_unit: str  # of the values
    knots: tuple[float, ...]  # rising
    values: tuple[float, ...]  # at the knots, and their 95 % intervals
    ci95: tuple[Interval, ...]  # one for each knot
    slope: float  # of the line itself there, which formula and likeness count in; 0 where it has none
    reached: Interval  # where the recordings were: beyond, the curve is a guess
    rms_before: float  # free-run error on samples that no fit has seen, without it and with it [unit of the output]
    rms_after: float  # with the law
    looks_like: str  # known law within the band, the end of a sentence; "" where none is
    formula: str  # shortest one within the band; "" without one
    rival: str  # what a curve over which explains nearly as much
    not_carried: tuple[str, ...]  # recordings on which the error does not fall


@dataclass(frozen=True, slots=True)
class OutputFit:
    """RMS of the free-run error of a further measured output, in ``unit``, and the noise of its reading."""

    name: str  # column, or what it is at where
    kind: str  # speed, position, torque or acceleration
    at: str  # motor, load or shaft
    unit: str  # SI
    retuned: float  # nominal parameters inside their tolerances
    augmented: float  # with the effects
    noise: float  # RMS of its reading's noise


@dataclass(frozen=True, slots=True)
class Fit:
    """RMS of the free-run simulation error, in ``unit``; holdout on samples not used for that fit.

    Of the recordings' first output; ``outputs`` has the further ones.
    """

    unit: str  # of the output
    nominal: float  # model as it was given
    retuned: float  # parameters inside their tolerances
    augmented: float  # with the effects
    holdout_retuned: float  # re-tuned, on unseen samples
    holdout_augmented: float  # with the effects, on unseen samples
    noise_floor: float  # RMS of the reading's noise, white and coloured
    outputs: tuple[OutputFit, ...] = ()  # the further ones


@dataclass(frozen=True, slots=True)
class Trace:
    """One recording with its simulations, for plots; each array has shape (N,), ``torque_nm`` (N, M)."""

    name: str  # of the recording
    time_s: FloatArray  # from its first sample
    torque_nm: FloatArray  # M inputs, as read
    measured: FloatArray  # output as read
    okay: BoolArray  # samples that count
    nominal: FloatArray  # free run of the model as given
    retuned: FloatArray  # ... inside its tolerances
    augmented: FloatArray  # ... with the effects
    holdout: bool  # whether no fit has seen it


@dataclass(frozen=True, slots=True)
class Course:
    """An estimate over the time of one recording with its 95 % band; arrays of shape (B,)."""

    time_s: FloatArray  # from the recording's first sample
    value: FloatArray  # in the unit of what has the course
    low: FloatArray  # ends of the band
    high: FloatArray  # ends of the band


@dataclass(frozen=True, slots=True)
class Equivalent:
    """The input at one place that by itself would explain the re-tuned model's error."""

    place: str  # where the input would act
    unit: str  # of the input
    courses: Mapping[str, Course]  # per recording
    log_likelihood: float  # of the error, if a random walk acts at this place
    plausible: bool  # whether its likelihood is close to that of the best place


@dataclass(frozen=True, slots=True)
class BandTest:
    """Power of an error in a band: how many times the floor's, and how probable that is by chance, all bands tried."""

    low_hz: float  # lower edge
    high_hz: float  # upper edge
    ratio: float  # power over that of the floor
    p_value: float  # all bands tried


@dataclass(frozen=True, slots=True)
class ErrorSpectrum:
    """Amplitude spectral density of the error over all recordings [unit of the output per root hertz]; shapes (M,)."""

    frequency_hz: FloatArray  # rising
    before: FloatArray  # of the re-tuned model
    after: FloatArray  # with the effects
    floor: float  # of the reading's noise
    bands: tuple[BandTest, ...]  # which stand out


@dataclass(frozen=True, slots=True)
class Response:
    """Response from torque to output in one recording, without a model and of the models; shapes (M,)."""

    frequency_hz: FloatArray  # rising
    measured: ComplexArray  # output over torque, without a model
    std: FloatArray  # standard deviation of `measured`
    coherence: FloatArray  # 0 to 1
    before: ComplexArray  # of the re-tuned model
    after: ComplexArray  # with the effects
    p_before: float  # that `measured` differs so much from `before` by chance
    p_after: float  # ... from `after`


@dataclass(frozen=True, slots=True)
class LawPicture:
    """A law over the signal it depends on, with the data: both are averages over bins; arrays of shape (K,)."""

    name: str  # of the effect
    element: Element  # where the law acts
    signal: str  # what it is drawn over, and the unit of torque or reading
    signal_unit: str  # SI
    unit: str  # of the law
    x: FloatArray  # mean of the signal in each bin
    data: FloatArray  # mean of what the re-tuned model lacks
    low: FloatArray  # ends of its 95 % band
    high: FloatArray  # ends of its 95 % band
    law: FloatArray  # the law, seen in the same way
    explained: float  # share of the law's power over time that is a function of this signal


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """What the re-tuned model lacks: as an input at every place, over time, frequency and operating region."""

    element: Element  # where an input alone would make the error most probable
    equivalents: tuple[Equivalent, ...]  # one for each place
    spectrum: ErrorSpectrum  # of the error
    responses: Mapping[str, Response]  # by recording
    pictures: tuple[LawPicture, ...]  # of laws over their signals


@dataclass(frozen=True, slots=True)
class OffNominal:
    """A nominal parameter that explains more outside of its tolerance."""

    name: str  # J_M, k, ...
    ratio: float  # its value there over the nominal one
    tolerance: float  # share of the nominal value that it is trusted to
    nominal: float | None = None  # as in the model file; None where it has none
    unit: str = ""  # SI

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

    verdict: Verdict  # one of four
    statement: str  # one paragraph for people
    mismatch: Mismatch  # where, when and at which frequencies
    effects: tuple[FoundEffect, ...]  # what is missing, the largest share first
    rejected: tuple[RejectedEffect, ...]  # rivals
    untestable: tuple[UntestableEffect, ...]  # neither shown nor excluded
    fit: Fit  # errors before and after
    parameters: Mapping[str, Retuned]  # nominal ones, by name, as they are without a law that has no name
    load_torque: Mapping[str, Estimated]  # constant one, by recording
    timing_s: Mapping[str, float]  # duration of each step [s]
    augmented: DrivelineModel  # the model with what was found
    traces: tuple[Trace, ...]  # for plots, by recording
    warnings: tuple[str, ...] = ()  # what is odd about recordings, model or fits
    discrepancy: Discrepancy | None = None  # for the report
    off_nominal: tuple[OffNominal, ...] = ()  # values beyond their tolerance that alone would explain it
    remainder: Remainder | None = None  # None where nothing is left
    slight: tuple[Slight, ...] = ()  # seen, and too small to matter
    refinements: tuple[Refinement, ...] = ()  # possible, not established, not in the model
    table: UnnamedTable | None = None  # law without a name in the augmented model
    effort: Effort = field(default_factory=Effort)  # what the search cost
    doubts: tuple[Doubt, ...] = ()  # of the input itself
