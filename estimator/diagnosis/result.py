"""What a diagnosis says. The fields are those of ``diagnosis.json`` in the contract, one to one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel
from estimator.signals.record import BoolArray, FloatArray

Interval = tuple[float, float]


class Verdict(Enum):
    """The three honest answers."""

    EXPLAINED = "explained"
    UNEXPLAINED = "unexplained"
    NO_MISMATCH = "no_mismatch"


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


@dataclass(frozen=True, slots=True)
class RejectedEffect:
    """A rival that was fitted, and why it lost; ``delta_bic`` is against the chosen explanation (negative)."""

    name: str
    reason: str
    delta_bic: float


@dataclass(frozen=True, slots=True)
class UntestableEffect:
    """An effect these recordings can't tell, and the test that could."""

    name: str
    reason: str
    suggested_test: str


@dataclass(frozen=True, slots=True)
class UnnamedLaw:
    """A law without a name for a mismatch that no entry explains.

    Attributes
    ----------
    terms : tuple of (str, float)
        Functions of what happens in the line, each with its coefficient: a torque [Nm] at motor, shaft, load or in the
        torque path, an error of the reading [unit of the output] at the sensor.
    rms_before, rms_after : float
        Free-run error without it, and what it would leave to first order.
    """

    element: Element
    terms: tuple[tuple[str, float], ...]
    rms_before: float
    rms_after: float


@dataclass(frozen=True, slots=True)
class Fit:
    """RMS of the free-run simulation error, in ``unit``; holdout on samples not used for that fit."""

    unit: str
    nominal: float
    retuned: float
    augmented: float
    holdout_retuned: float
    holdout_augmented: float
    noise_floor: float


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
class Diagnosis:
    """The whole answer.

    ``unnamed`` is given where there is a mismatch that no effect explains; ``load_torque`` is the constant load torque
    of each recording, by name.
    """

    verdict: Verdict
    statement: str
    mismatch: Mismatch
    effects: tuple[FoundEffect, ...]
    rejected: tuple[RejectedEffect, ...]
    untestable: tuple[UntestableEffect, ...]
    unnamed: UnnamedLaw | None
    fit: Fit
    parameters: Mapping[str, Retuned]
    load_torque: Mapping[str, Estimated]
    timing_s: Mapping[str, float]
    augmented: DrivelineModel
    traces: tuple[Trace, ...]
    warnings: tuple[str, ...] = ()
